"""Figures of the validation on signals and shapes with a known answer."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.validation import static_figures
from pipeline.validation.behaviours import run_behaviour
from pipeline.validation.breath_figures import loop_turn, phase_angle
from pipeline.validation.burst_figures import cough_figures, sneeze_figures
from pipeline.validation.capacity_figures import girth
from pipeline.validation.static_figures import SONG, belly_gain, falls, reached
from sim.errors import ParameterError
from sim.events import burst_frames

TURN = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
CMH2O = 98.0665


@pytest.mark.parametrize("phase", [0.0, 10.0, 45.0, 80.0, 120.0, 170.0, 180.0])
def test_phase_angle_of_two_sines(phase):
    rib_cage, abdomen = np.sin(TURN), 3.0 * np.sin(TURN + np.radians(phase))
    assert phase_angle(rib_cage, abdomen) == pytest.approx(phase, abs=1.0)


def test_loop_turns_counter_clockwise_when_the_abdomen_leads():
    lead = np.radians(20.0)
    assert loop_turn(np.sin(TURN), np.sin(TURN + lead)) > 0.0
    assert loop_turn(np.sin(TURN), np.sin(TURN - lead)) < 0.0


def test_tape_round_a_tilted_cylinder():
    n, radius = 400, 0.15
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(n)], axis=1)
    vertices = np.vstack([ring + np.array([0.0, 0.0, z]) for z in (-0.3, 0.3)])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    faces = np.vstack([np.stack([i, j, n + i], 1), np.stack([j, n + j, n + i], 1)])
    level = girth(vertices, faces, np.array([radius, 0.0, 0.01]), np.array([-radius, 0.0, 0.01]))
    assert level == pytest.approx(2.0 * np.pi * radius, rel=1e-3)
    tilted = girth(vertices, faces, np.array([radius, 0.0, 0.1]), np.array([-radius, 0.0, -0.1]))
    # an ellipse with half axes r and r / cos (Ramanujan)
    a, b = radius, float(np.hypot(radius, 0.1))
    ellipse = np.pi * (3.0 * (a + b) - np.sqrt((3.0 * a + b) * (a + 3.0 * b)))
    assert tilted == pytest.approx(ellipse, rel=1e-3)


def test_pressure_beyond_what_was_tried_is_said_so():
    pressure, volume = np.array([-20.0, 0.0, 20.0]), np.array([1.0, 3.0, 5.0])
    assert reached(pressure, volume, 4.0) == pytest.approx(10.0)
    assert reached(pressure, volume, 6.0) == "> 20"
    assert reached(pressure, volume, 0.5) == "< -20"


def test_rotation_has_to_fall_in_both_components():
    figures = {f"rib_{axis}_{rib}": 10.0 - rib for axis in ("pump", "bucket") for rib in (1, 2, 3)}
    assert falls(figures, "rib", range(1, 4))
    assert not falls({**figures, "rib_pump_3": 9.5}, "rib", range(1, 4))


def planted_cough():
    """In 1.5 L in 1 s, closed for 0.2 s, then a pulse of flow that peaks after 50 ms."""
    time = np.arange(0.0, 2.0, 0.005)
    after = np.clip(time - 1.2, 0.0, None)
    pulse = 8e-3 * (after / 0.05) * np.exp(1.0 - after / 0.05)
    flow = np.where(time < 1.0, -1.5e-3, 0.0) + pulse
    lung = 3e-3 - np.cumsum(flow) * 0.005
    press = 200.0 * CMH2O * np.exp(-(((time - 1.2) / 0.1) ** 2))
    trajectory = SimpleNamespace(
        flow=flow, lung=lung, pleural=press - 5.0 * CMH2O, abdominal=press, alveolar=press
    )
    return SimpleNamespace(trajectory=trajectory, motion=SimpleNamespace(time=time))


def test_figures_of_a_planted_cough():
    found = cough_figures(planted_cough(), None)
    assert found["peak_flow"] == pytest.approx(8.0, rel=0.01)
    assert found["compression"] == pytest.approx(0.2, abs=0.01)
    assert found["time_to_peak_ms"] == pytest.approx(50.0, abs=6.0)
    assert found["inspired"] == pytest.approx(1.5, rel=0.02)
    assert found["gastric_pressure"] == pytest.approx(200.0, rel=0.01)
    assert found["expired"] == pytest.approx(8.0 * np.e * 0.05, rel=0.05)


def test_the_burst_of_a_sneeze_ends_before_what_wavers_after_it():
    # x exp(1 - x) is over a fifth from x = 0.08 to 3.99; x = 1 after 50 ms
    run = planted_cough()
    assert sneeze_figures(run, None)["expiration"] == pytest.approx(0.196, abs=0.011)
    run.trajectory.flow[340:350] += 3e-3
    assert sneeze_figures(run, None)["expiration"] == pytest.approx(0.196, abs=0.011)


def test_bursts_stand_out_of_a_slow_fall():
    time = np.arange(0.0, 3.0, 0.01)
    pressure = 1000.0 * (np.clip(np.sin(2.0 * np.pi * 5.0 * time), 0.0, None) - 0.1 * time)
    peaks = burst_frames(pressure)
    assert len(peaks) == 15
    assert np.diff(time[peaks]).mean() == pytest.approx(0.2, rel=0.01)


def test_behaviour_that_is_not_there_is_refused():
    with pytest.raises(ParameterError, match="yodel"):
        run_behaviour("yodel", None, "upright")


@pytest.mark.parametrize(("end", "expected"), [(0.8, np.nan), (1.25, 0.8)])
def test_a_belly_that_does_not_reach_the_pressure_has_no_gain_there(
    monkeypatch: pytest.MonkeyPatch, end: float, expected: float
) -> None:
    curve = {"abdominal": np.array([0.0, end * SONG]), "wall": np.array([0.0, 1.0])}
    monkeypatch.setattr(static_figures, "belly_inflation", lambda *_, **__: ([], None))
    monkeypatch.setattr(static_figures, "as_arrays", lambda *_: curve)
    found = belly_gain(SimpleNamespace())["belly_gain"]  # type: ignore[arg-type]
    assert found == pytest.approx(expected, nan_ok=True)
