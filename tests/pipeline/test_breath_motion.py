"""The steady breath that a fit keeps: whole, in the file, with ribs and figures that agree."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.breath_motion import FIGURES, RIBS, best_breath, with_measured
from pipeline.model import TorsoModel
from sim.model.torso import Subject
from sim.trajectory import load_motion, save_motion

NAMES = ("CLAV", "STRN", "NAVEL", "LLCH")
TIMING = (1.0, 1.44, 0.21)
"""s; a breath is 61 frames, so that none falls between those of the fit."""
BEND = (-0.02, 0.03, 0.05)


@pytest.mark.slow
def test_kept_breath_is_the_run_of_the_fit(tmp_path):
    model = TorsoModel(subject=Subject(sex="male", stature=1.756, mass=75.0), workers=1)
    unit, levels = (1.0, 1.0, 1.0), np.array([0.2, 0.05, 0.0, 0.02])
    landmarks = model.landmarks(unit, "upright")
    inspiration, expiration, pause = TIMING
    fit = SimpleNamespace(
        fit_scale=unit,
        posture="upright",
        labels=NAMES,
        points=np.array([landmarks[name] for name in NAMES]),
        bend=BEND,
        levels=levels,
        inspiration_time=inspiration,
        expiration_time=expiration,
        pause_time=pause,
    )
    breath = best_breath(fit, model, 25.0)
    run = model.simulator(
        unit,
        "upright",
        fit.points,
        inspiration_time=inspiration,
        expiration_time=expiration,
        pause_time=pause,
        rate=25.0,
        bend=BEND,
    ).run(levels[None])
    assert len(run.time) == 61
    assert np.allclose(breath.motion.time, run.time, atol=1e-9)
    assert np.allclose(breath.motion.markers, run.positions[0], atol=1e-9)

    # the figures are those of the lung's fullest frame, the drawn angles those of all frames
    fullest = int(np.argmax(breath.motion.volumes["lung"]))
    told = [breath.figures["rib_rotation_deg"][f"rib_{rib}"]["pump"] for rib in RIBS]
    assert np.allclose(breath.pump[fullest], told, atol=0.02)
    assert breath.bucket[fullest].min() > 0
    assert set(breath.figures) == set(FIGURES)
    assert breath.figures["pleural_pressure_cmh2o"][0] < breath.figures["pleural_pressure_cmh2o"][1]

    path = tmp_path / "trajectory.h5"
    save_motion(path, breath.motion, {"version": "0", "seed": 1})
    kept, _ = load_motion(path)
    assert kept.marker_names == NAMES
    assert np.array_equal(kept.markers, breath.motion.markers)
    assert kept.elements is not None


def test_measured_markers_differ_by_what_the_fit_scores(small_motion):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    period = small_motion.time[-1] + 0.04
    simulated = np.random.default_rng(2).normal(size=small_motion.markers.shape)
    fit = SimpleNamespace(
        inspiration_time=0.4 * period,
        expiration_time=0.6 * period,
        time=small_motion.time,
        positions=simulated,
        rotation=turn,
    )
    # 3 mm along the recording's first axis, which is the torso's second
    signature = SimpleNamespace(time=small_motion.time, mean=simulated + np.eye(3)[0] * 0.003)
    away = with_measured(small_motion, fit, signature).measured - small_motion.markers
    assert np.allclose(away, [0.0, 0.003, 0.0], atol=1e-12)
