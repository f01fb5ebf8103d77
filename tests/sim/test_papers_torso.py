"""The torso of the papers' set: it rests, breathes with the printed activations, ends every run."""

from __future__ import annotations

import numpy as np
import pytest

from sim.behaviour import run_controls
from sim.breaths import sawtooth
from sim.control.library import STYLES, find_controls
from sim.model.torso import Subject
from sim.motion import rest_motion, volumes_inside
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


@pytest.mark.slow
def test_dilorenzo_section_6_3_1_lung_fills_four_fifths_of_the_bound_chest(
    papers: RestingTorso,
) -> None:
    run = breathe(papers, BREATH)
    still = rest_motion(papers, "upright")
    bound = float(volumes_inside(still.soft["chest_cavity"])[0])
    assert run.lung_model == "one_way"
    assert run.chest[0] == pytest.approx(bound, rel=1e-4)
    assert run.lung[0] == pytest.approx(0.8 * bound, rel=1e-3)
    assert still.volumes["lung"][0] == pytest.approx(0.8 * bound)


@pytest.mark.slow
@pytest.mark.parametrize("style", [s for s in STYLES if s != "vital_capacity"])
def test_every_printed_behaviour_ends(papers: RestingTorso, style: str) -> None:
    controls = find_controls(style, "papers")
    assert controls.run_duration is not None
    done = run_controls(papers, controls, posture="upright", duration=controls.run_duration)
    found, run = done.figures(), done.trajectory
    assert found["tidal_volume_l"] > 0.0
    assert 0.0 < run.lung.min() < run.lung.max() < run.chest.max()
    np.testing.assert_array_equal(done.motion.volumes["lung"], run.lung)
    np.testing.assert_allclose(done.motion.volumes["chest_cavity"], run.chest, rtol=1e-3)
