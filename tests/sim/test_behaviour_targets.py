"""What the calibrated behaviours must reach on the upright reference man (physiology.csv)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from sim.behaviour import run_controls
from sim.cli import read_task, run_task
from sim.control.library import STYLES, find_controls
from sim.motion import Motion
from sim.resting import RestingTorso
from sim.simulate import simulate

Run = Callable[..., tuple[Motion, dict[str, Any]]]


@pytest.fixture(scope="module")
def run(resting: RestingTorso) -> Run:
    """Run a behaviour once."""

    @cache
    def made(style: str, *words: str) -> tuple[Motion, dict[str, Any]]:
        return run_task(read_task([style, *words]), resting)

    return made


def test_cough(run: Run) -> None:
    """Man 2003, Lee 2015, Leith 1986: pressure, closure, flow, inspired volume."""
    figures = run("cough")[1]
    assert 172.0 <= figures["peak_gastric_pressure_cmh2o"] <= 256.0
    assert 0.1 <= figures["closed_glottis_s"] <= 0.45
    assert 3.0 <= figures["peak_flow_l_s"] <= 9.0
    assert 1.0 <= figures["inspired_above_rest_l"] <= 3.5
    assert figures["burst_rate_hz"] is None
    assert figures["abdomen_volume_error"] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("style", ["laugh", "belly_laugh"])
def test_laughs(run: Run, style: str) -> None:
    """Filippelli 2001: rate, fall, its time and its thirds."""
    figures = run(style)[1]
    assert 3.5 <= figures["burst_rate_hz"] <= 5.7
    assert 1.15 <= figures["volume_fall_l"] <= 1.95
    assert 1.5 <= figures["volume_fall_time_s"] <= 5.9
    for share in figures["volume_fall_share"].values():
        assert 0.25 <= share <= 0.42


VOLUME, FLOW, PRESSURE = "tidal_volume_l", "peak_flow_l_s", "peak_gastric_pressure_cmh2o"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("style", "stated"),
    [
        ("deep", (VOLUME, FLOW, PRESSURE)),
        ("vital_capacity", (VOLUME, PRESSURE)),
        ("laugh", (VOLUME, FLOW, PRESSURE)),
        ("cough", (VOLUME, FLOW, PRESSURE)),
        ("sneeze", (VOLUME, FLOW, PRESSURE)),
    ],
)
def test_halving_the_step_hardly_changes_what_is_stated(
    resting: RestingTorso, style: str, stated: tuple[str, ...]
) -> None:
    controls = find_controls(style)
    duration = controls.run_duration
    assert duration is not None
    step = controls.run_step
    coarse, fine = (
        run_controls(resting, controls, posture="upright", duration=duration, step=h).figures()
        for h in (step, 0.5 * step)
    )
    for name in stated:
        assert coarse[name] == pytest.approx(fine[name], rel=0.02), name


@pytest.mark.slow
def test_a_giggle_is_a_small_laugh(run: Run) -> None:
    giggle, laugh = run("giggle")[1], run("laugh")[1]
    assert 3.5 <= giggle["burst_rate_hz"] <= 5.7
    for key in ("volume_fall_l", "peak_alveolar_pressure_cmh2o", "peak_gastric_pressure_cmh2o"):
        assert 0.0 < giggle[key] < laugh[key]


@pytest.mark.slow
def test_sneeze(run: Run) -> None:
    """Gasps, hold, expiration; flow and volume as far as they are known."""
    moved, figures = run("sneeze")
    lung, time = moved.volumes["lung"] * 1e3, moved.time
    grown = [
        np.ptp(lung[(time > a) & (time <= b)]) for a, b in ((0, 0.45), (0.45, 0.9), (0.9, 1.4))
    ]
    assert 0.0 < grown[0] < grown[1] < grown[2]
    assert 1.0 <= figures["inspired_above_rest_l"] <= 2.5
    assert 5.0 <= figures["peak_flow_l_s"] <= 14.0
    assert figures["closed_glottis_s"] == pytest.approx(0.3)
    skull = moved.bodies.index("skull")
    assert moved.position[:, skull, 0].max() > moved.position[0, skull, 0] + 0.05


@pytest.mark.slow
def test_panting_is_shallow(run: Run) -> None:
    panting, calm = run("panting")[1], run("calm")[1]
    assert panting["breaths_per_min"] == 60.0 and panting["steady"]
    assert 0.05 < panting["tidal_volume_l"] < calm["tidal_volume_l"]
    assert 0.4 <= calm["tidal_volume_l"] <= 0.6


@pytest.mark.slow
def test_a_forced_expiration_goes_far_below_rest(run: Run) -> None:
    figures = run("forced_exhale")[1]
    assert figures["volume_fall_l"] > 1.0 and figures["peak_flow_l_s"] > 3.0


@pytest.mark.slow
@pytest.mark.parametrize("form", ["calibrated", "papers"])
def test_paradoxical_breathing_loses_air(run: Run, form: str) -> None:
    """dilorenzo2009 section 7.2: 400 mL against 800 mL."""
    odd = run("paradoxical", "--form", form)[1]
    normal = run("paradoxical_normal", "--form", form)[1]
    assert odd["tidal_volume_l"] <= 0.6 * normal["tidal_volume_l"]


@pytest.mark.slow
@pytest.mark.parametrize("style", [s for s in STYLES if s != "vital_capacity"])
def test_printed_forms_run(run: Run, style: str) -> None:
    figures = run(style, "--form", "papers")[1]
    assert figures["form"] == "papers"
    assert figures["abdomen_volume_error"] < 0.02
    rate = figures["burst_rate_hz"]
    assert rate == pytest.approx(5.0, rel=0.03) if "laugh" in style else True


@pytest.mark.slow
@pytest.mark.parametrize("style", ["laugh", "belly_laugh", "cough", "sneeze"])
def test_halving_the_step_hardly_changes_peaks_and_volumes(
    resting: RestingTorso, style: str
) -> None:
    peaks = []
    for half in (False, True):
        controls = find_controls(style)
        if half:
            controls = replace(controls, step=0.5 * controls.run_step)
        assert controls.duration is not None
        drive = controls.drive(controls.duration)
        found = simulate(
            resting, drive.activation, posture="upright", step=controls.run_step,
            rate=controls.run_frames, larynx=drive.larynx, bend=drive.bend,
        )  # fmt: skip
        peaks.append([found.alveolar.max(), found.abdominal.max(), np.ptp(found.lung)])
    np.testing.assert_allclose(peaks[0], peaks[1], rtol=0.03)
