"""The synthetic subjects: their form, their truth, their sizes against published ranges."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
import pytest

SUBJECTS = ("subject1", "subject2", "subject3", "subject4")
BACK = ("C7", "T5", "T10", "L1")
MODES = ("upper_mm_per_l", "lower_mm_per_l", "abdomen_mm_per_l")


def truth_of(folder: Path, name: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / f"{name}.truth.json").read_text("utf-8"))
    return content


def markers_of(folder: Path, name: str) -> tuple[list[str], np.ndarray]:
    """Labels without prefix and positions (n_frames, n_markers, 3), mm, NaN where lost."""
    content = ezc3d.c3d(str(folder / f"{name}.c3d"))
    labels = [label.split(":")[-1] for label in content["parameters"]["POINT"]["LABELS"]["value"]]
    points = content["data"]["points"][:3].transpose(2, 1, 0)
    return labels, np.where((points == 0.0).all(axis=2, keepdims=True), np.nan, points)


def in_body_axes(positions: np.ndarray, rest: np.ndarray, back: list[int]) -> np.ndarray:
    """Positions with the trunk's rigid motion taken out by the back markers (Kabsch)."""
    moved = np.empty_like(positions)
    for frame, points in enumerate(positions):
        seen = [k for k in back if np.isfinite(points[k, 0])]
        here = points[seen].mean(axis=0)
        u, _, vt = np.linalg.svd((points[seen] - here).T @ (rest[seen] - rest[seen].mean(axis=0)))
        sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
        moved[frame] = (points - here) @ (u @ sign @ vt) + rest[seen].mean(axis=0)
    return moved


def usual_breath(truth: dict[str, Any]) -> tuple[float, float]:
    """Mean rib cage and abdomen volume (L) of the breaths that are no sighs."""
    breaths = [b for b in truth["breaths"] if not b["sigh"]]
    tidal = np.array([b["tidal_volume_ml"] for b in breaths]) / 1e3
    share = np.array([b["rib_cage_share"] for b in breaths])
    return float((tidal * share).mean()), float((tidal * (1.0 - share)).mean())


def breath_motion(truth: dict[str, Any], label: str) -> np.ndarray:
    """Displacement (3,) mm of a marker in a usual breath, body axes, trunk at rest."""
    rib_cage, abdomen = usual_breath(truth)
    part = truth["rib_cage_share_upper"]
    scale = np.array([part * rib_cage, (1.0 - part) * rib_cage, abdomen])
    return scale @ np.array([truth["markers"][label][mode] for mode in MODES])


@pytest.mark.parametrize("name", SUBJECTS)
def test_form_of_the_file(data_samples: Path, name: str) -> None:
    content = ezc3d.c3d(str(data_samples / f"{name}.c3d"))
    point = content["parameters"]["POINT"]
    assert point["USED"]["value"] == [22]
    assert point["RATE"]["value"] == [100.0]
    assert point["UNITS"]["value"] == ["mm"]
    assert content["data"]["points"].shape[2] >= 6000
    labels, _ = markers_of(data_samples, name)
    assert labels == list(truth_of(data_samples, name)["markers"])


def test_ways_of_losing_a_marker(data_samples: Path) -> None:
    for name in SUBJECTS:
        labels, positions = markers_of(data_samples, name)
        lost = np.isnan(positions[:, :, 0])
        assert lost.mean() == pytest.approx(
            truth_of(data_samples, name)["markers_lost_fraction"], abs=1e-6
        )
        assert 0 < lost.sum() < 0.01 * lost.size
        assert len(labels) == len(set(labels))
    flagged = ezc3d.c3d(str(data_samples / "subject2.c3d"))["data"]["meta_points"]["residuals"]
    assert (flagged >= 0.0).all()


def test_subjects_differ(data_samples: Path) -> None:
    truths = [truth_of(data_samples, name) for name in SUBJECTS]
    assert {t["sex"] for t in truths} == {"male", "female"}
    for key in ("stature_m", "mass_kg", "style"):
        assert len({t[key] for t in truths}) == 4
    shares = [np.mean([b["rib_cage_share"] for b in t["breaths"]]) for t in truths]
    assert shares[1] > 0.85
    assert shares[0] > 0.7
    assert all(0.45 <= share <= 0.75 for share in shares[2:])


@pytest.mark.parametrize("name", SUBJECTS)
def test_breaths_lie_in_published_ranges(data_samples: Path, name: str) -> None:
    breaths = [b for b in truth_of(data_samples, name)["breaths"] if not b["sigh"]]
    period = np.array([b["end_s"] - b["onset_s"] for b in breaths])
    inspiration = np.array([b["peak_s"] - b["onset_s"] for b in breaths])
    tidal = np.array([b["tidal_volume_ml"] for b in breaths])
    assert len(breaths) >= 12
    assert 10.0 <= 60.0 / period.mean() <= 20.0
    assert 350.0 <= tidal.mean() <= 700.0
    assert 0.37 <= (inspiration / period).mean() <= 0.47
    assert 0.10 <= tidal.std() / tidal.mean() <= 0.48


def test_sighs_and_active_exhale(data_samples: Path) -> None:
    truths = {name: truth_of(data_samples, name) for name in SUBJECTS}
    assert sum(b["sigh"] for t in truths.values() for b in t["breaths"]) == 2
    for truth in truths.values():
        usual = np.median([b["tidal_volume_ml"] for b in truth["breaths"]])
        sighs = [b["tidal_volume_ml"] for b in truth["breaths"] if b["sigh"]]
        assert all(2.0 <= volume / usual <= 5.0 for volume in sighs)
    rest = {
        name: np.mean([b["end_expiratory_volume_ml"] for b in t["breaths"]])
        for name, t in truths.items()
    }
    assert rest["subject3"] < -100.0
    assert abs(rest["subject2"]) < 50.0
    assert abs(rest["subject4"]) < 50.0


def test_surface_motion_has_the_published_size(data_samples: Path) -> None:
    cranial, ventral, lateral, navel = [], [], [], []
    for name in SUBJECTS:
        truth = truth_of(data_samples, name)
        up = np.array([truth["markers"][label]["rest_mm"][2] for label in ("LUCH", "LMCH")])
        # De Groote measured in the laboratory, so the trunk's own share belongs to it.
        tilt = np.radians(truth["trunk_pitch_deg_per_tidal_volume"])
        trunk = truth["trunk_shift_mm_per_tidal_volume"] + tilt * (up - truth["hips_mm"][2])
        motion = np.array([breath_motion(truth, label) for label in ("LUCH", "LMCH")])
        cranial.append(motion[:, 2].mean())
        ventral.append((motion[:, 0] + trunk).mean())
        lateral.append(motion[:, 1].mean())
        navel.append(breath_motion(truth, "NAVEL"))
    assert 3.0 <= np.mean(cranial) <= 5.0
    assert all(2.5 <= value <= 5.5 for value in cranial)
    assert all(3.0 <= value <= 5.5 for value in ventral)
    assert all(0.5 <= value <= 2.0 for value in lateral)
    assert np.abs(np.array(navel)[:, 1:]).max() < 0.1
    assert all(2.9 <= value <= 10.0 for value in np.array(navel)[2:, 0])


@pytest.mark.parametrize("name", SUBJECTS)
def test_markers_agree_with_the_true_volumes(data_samples: Path, name: str) -> None:
    truth = truth_of(data_samples, name)
    labels, positions = markers_of(data_samples, name)
    rest = np.array([truth["markers"][label]["rest_mm"] for label in labels])
    with (data_samples / f"{name}.truth.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    frames = [round(float(row["time_s"]) * truth["rate_hz"]) for row in rows]
    body = in_body_axes(positions, rest, [labels.index(label) for label in BACK])[frames]
    whole = np.isfinite(body).all(axis=(1, 2))
    design = np.array([[truth["markers"][k][mode] for k in labels] for mode in MODES])
    found = np.linalg.lstsq(design.reshape(3, -1).T, (body - rest)[whole].reshape(-1, 66).T)[0]
    true = np.array(
        [[float(row[key]) / 1e3 for key in ("rib_cage_ml", "abdomen_ml")] for row in rows]
    )
    for volume, known in zip((found[0] + found[1], found[2]), true[whole].T, strict=True):
        difference = volume - known
        assert np.std(difference) < 0.02
    lung = true[whole].sum(axis=1)
    assert np.corrcoef(found.sum(axis=0), lung)[0, 1] > 0.97
    assert np.polyfit(lung, found.sum(axis=0), 1)[0] == pytest.approx(1.0, abs=0.05)


def test_onset_is_where_lung_volume_starts_to_rise(data_samples: Path) -> None:
    for name in SUBJECTS:
        table = np.loadtxt(data_samples / f"{name}.truth.csv", delimiter=",", skiprows=1)
        for breath in truth_of(data_samples, name)["breaths"]:
            resting = (table[:, 0] >= breath["rest_s"]) & (table[:, 0] <= breath["end_s"])
            assert np.ptp(table[resting, 1]) < 1.0
            rising = (table[:, 0] > breath["onset_s"]) & (table[:, 0] < breath["peak_s"])
            assert (np.diff(table[rising, 1]) > 0.0).all()


def test_made_again_it_is_the_same(data_samples: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "data_samples.make_samples", "--subject", "subject4"]
    subprocess.run([*command, "--out", str(tmp_path)], cwd=data_samples.parent, check=True)
    old, new = (markers_of(folder, "subject4")[1] for folder in (data_samples, tmp_path))
    np.testing.assert_allclose(new, old, atol=1e-3)
    first, second = (truth_of(folder, "subject4") for folder in (data_samples, tmp_path))
    assert [b["sigh"] for b in first["breaths"]] == [b["sigh"] for b in second["breaths"]]
    for key in ("onset_s", "peak_s", "end_s", "tidal_volume_ml"):
        np.testing.assert_allclose(
            [b[key] for b in first["breaths"]], [b[key] for b in second["breaths"]], atol=0.1
        )
