"""The torso with the papers' muscles: it rests and breathes with the printed activations."""

from __future__ import annotations

import numpy as np
import pytest

from sim.breaths import sawtooth
from sim.model.torso import Subject
from sim.physics.types import Floats
from sim.resting import RestingTorso, rest_torso
from sim.simulate import Trajectory, group_activation, simulate
from sim.tables import parameters

PERIOD, STEP = 4.0, 0.001
"""s: a breath of the printed control file (section 8.1), the step of section 4.3."""
BREATH = (0.3, 0.1, 0.0, 0.0)
PARADOXICAL = (0.3, 0.1, 0.0, 0.1)
"""dilorenzo2009 Table 7.1; the abdomen of the second acts while breathing in (section 7.2)."""


@pytest.fixture(scope="module")
def papers() -> RestingTorso:
    return rest_torso(
        Subject(sex="male", stature=1.756, mass=75.0), parameters=parameters("papers")
    )


def breathe(torso: RestingTorso, levels: tuple[float, ...], breaths: int = 2) -> Trajectory:
    time = np.arange(round(breaths * PERIOD / STEP)) * STEP
    shape: Floats = sawtooth(time, inspiration=2.0, expiration=2.0, pause=0.0)[0]
    drive = group_activation(shape[:, None] * np.array(levels), torso.torso.parameters)
    return simulate(torso, drive, posture="upright", step=STEP)


def tidal_volume(run: Trajectory) -> float:
    last = run.lung[run.time > run.time[-1] - PERIOD]
    return float(np.ptp(last))


@pytest.mark.slow
def test_papers_torso_stays_at_rest(papers: RestingTorso) -> None:
    run = breathe(papers, (0.0, 0.0, 0.0, 0.0))
    assert np.abs(run.lung - run.lung[0]).max() < 5e-6


@pytest.mark.slow
def test_dilorenzo_table_7_1_breath(papers: RestingTorso) -> None:
    run = breathe(papers, BREATH)
    # Fig. 7.3: approximately 800 ml; the scale of Table 8.1 was chosen with it in view.
    assert tidal_volume(run) == pytest.approx(0.8e-3, rel=0.25)
    assert run.lung[-1] == pytest.approx(run.lung[0], abs=20e-6)
    # Section 3.2.1: an error of the volume below two per cent during breathing.
    volume = papers.torso.plant.constants.abdomen_volume
    assert np.abs(run.abdomen / volume - 1.0).max() < 0.02


@pytest.mark.slow
def test_dilorenzo_section_7_2_paradoxical_breath_moves_less_air(papers: RestingTorso) -> None:
    # Printed: 400 ml, half of the normal breath; here it is less than half.
    assert tidal_volume(breathe(papers, PARADOXICAL)) < 0.5 * tidal_volume(breathe(papers, BREATH))
