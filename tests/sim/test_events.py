"""Figures of events: bursts of a known rate, a fall of known shares, peaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sim.events import burst_rate, event_figures, fall_shares
from sim.motion import Motion, rest_motion
from sim.resting import RestingTorso
from sim.simulate import Trajectory
from sim.units import PASCAL_PER_CMH2O

TIME = np.arange(1, 401) / 100.0


@pytest.fixture(scope="module")
def still(resting: RestingTorso) -> Motion:
    return rest_motion(resting, "upright")


@pytest.mark.parametrize("rate", [3.5, 4.6, 5.0])
def test_bursts_are_counted(rate: float) -> None:
    effort = 900.0 * np.minimum(TIME, 1.0) * (TIME < 3.5)
    pressure = effort + 500.0 * np.sin(2.0 * np.pi * rate * TIME) * (TIME < 3.5)
    assert burst_rate(TIME, pressure) == pytest.approx(rate, rel=0.02)


def test_what_is_no_laugh_has_no_bursts() -> None:
    assert burst_rate(TIME, np.zeros(len(TIME))) is None
    ripple = 20.0 * np.sin(2.0 * np.pi * 5.0 * TIME)
    assert burst_rate(TIME, ripple) is None
    assert burst_rate(TIME, 2000.0 * np.sin(2.0 * np.pi * TIME)) is None
    # two coughs with a ripple on them are no rhythm
    coughs = 9000.0 * np.exp(-(((TIME[:, None] - [1.0, 2.2]) / 0.1) ** 2)).sum(axis=1)
    assert burst_rate(TIME, coughs + 5.0 * ripple) is None


def _lowered(still: Motion, shift: float) -> Motion:
    """Two frames: at rest, and with the belly wall moved backwards."""
    belly = still.soft["abdomen"]
    n_dome = len(still.soft["diaphragm"].faces)
    wall = np.setdiff1d(np.unique(belly.faces[:-n_dome]), np.unique(belly.faces[-n_dome:]))
    moved = belly.vertices[0].copy()
    middle = moved[wall].mean(axis=0)
    moved[wall] += shift * (middle - moved[wall])
    both = {k: replace(s, vertices=np.repeat(s.vertices, 2, axis=0)) for k, s in still.soft.items()}
    both["abdomen"] = replace(belly, vertices=np.stack([belly.vertices[0], moved]))
    lung = still.volumes["lung"][0] - np.array([0.0, 1e-3])
    return replace(
        still, time=np.array([0.1, 0.2]), soft=both,
        markers=np.repeat(still.markers, 2, axis=0), volumes={**still.volumes, "lung": lung},
    )  # fmt: skip


def test_a_belly_that_shrinks_alone_has_the_whole_share(still: Motion) -> None:
    shares = fall_shares(_lowered(still, 0.05), still, 1)
    assert shares is not None
    assert shares == pytest.approx({"upper_rib_cage": 0.0, "lower_rib_cage": 0.0, "abdomen": 1.0})
    assert fall_shares(_lowered(still, 0.0), still, 1) is None


def test_event_figures_have_their_units(still: Motion) -> None:
    zero, cm = np.zeros(2), PASCAL_PER_CMH2O
    run = Trajectory(
        time=np.array([0.1, 0.2]), qpos=zero, soft=zero, lung=zero, chest=zero, abdomen=zero,
        alveolar=np.array([0.0, 50.0]) * cm, pleural=np.array([-5.0, 40.0]) * cm,
        abdominal=np.array([20.0, 120.0]) * cm, flow=np.array([-1e-3, 7e-3]), tension=zero,
    )  # fmt: skip
    figures = event_figures(run, _lowered(still, 0.05), still, closed=0.25)
    assert figures["volume_fall_l"] == pytest.approx(1.0)
    assert figures["volume_fall_time_s"] == pytest.approx(0.1)
    assert figures["inspired_above_rest_l"] == 0.0
    assert figures["peak_alveolar_pressure_cmh2o"] == pytest.approx(50.0)
    assert figures["peak_gastric_pressure_cmh2o"] == pytest.approx(100.0)
    assert figures["peak_transdiaphragmatic_pressure_cmh2o"] == pytest.approx(55.0)
    assert figures["peak_flow_l_s"] == pytest.approx(7.0)
    assert figures["peak_inspiratory_flow_l_s"] == pytest.approx(1.0)
    assert figures["closed_glottis_s"] == 0.25 and figures["burst_rate_hz"] is None
