"""The bone set: complete, valid, symmetric, in one frame, as long as published."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "sim" / "data"
MIRROR = np.array([1.0, -1.0, 1.0])
RIBS = [f"{side}{number}" for side in "LR" for number in range(1, 13)]
LEVELS = [
    f"{part}{n}" for part, count in (("C", 7), ("T", 12), ("L", 5)) for n in range(1, count + 1)
]
BONES = {
    *(f"rib_{name}" for name in RIBS), *LEVELS, "sternum", "skull", "jaw", "sacrum",
    *(f"{name}_{side}" for name in ("clavicle", "scapula", "pelvis") for side in "LR"),
}  # fmt: skip

Arrays = dict[str, npt.NDArray[Any]]


@pytest.fixture(scope="module")
def bones() -> Arrays:
    with np.load(DATA / "bones.npz") as file:
        return {key: file[key] for key in file.files}


def arc_length(points: npt.NDArray[np.float64]) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def measurements() -> list[dict[str, str]]:
    with Path(__file__).with_name("rib_measurements.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_bone_is_there_and_described(bones: Arrays) -> None:
    about = json.loads((DATA / "bones.json").read_text())
    assert {key.split("/")[1] for key in bones if key.startswith("mesh/")} == BONES
    assert set(about["bones"]) == BONES
    assert about["licence"] == "Apache-2.0"
    assert {key: list(bones[key].shape) for key in about["arrays"]} == about["arrays"]


@pytest.mark.parametrize("name", sorted(BONES))
def test_faces_are_valid_and_turned_outwards(bones: Arrays, name: str) -> None:
    vertices, faces = bones[f"mesh/{name}/vertices"], bones[f"mesh/{name}/faces"]
    assert np.isfinite(vertices).all()
    assert faces.min() == 0
    assert faces.max() == len(vertices) - 1
    assert (np.diff(np.sort(faces, axis=1), axis=1) > 0).all()
    corner = vertices[faces].astype(np.float64) - vertices.mean(axis=0)
    assert np.linalg.det(corner).sum() > 0


@pytest.mark.parametrize("name", [*(f"rib_{rib}" for rib in RIBS), "sternum", "T7", "L3", "sacrum"])
def test_mesh_is_closed(bones: Arrays, name: str) -> None:
    faces = bones[f"mesh/{name}/faces"]
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_meshes_are_mirror_images(bones: Arrays) -> None:
    for name in sorted(bone for bone in BONES if "_L" in bone):
        left = bones[f"mesh/{name}/vertices"]
        right = bones[f"mesh/{name.replace('_L', '_R')}/vertices"] * MIRROR
        np.testing.assert_allclose(left.min(axis=0), right.min(axis=0), atol=0.004, err_msg=name)
        np.testing.assert_allclose(left.max(axis=0), right.max(axis=0), atol=0.004, err_msg=name)


def test_derived_points_are_exactly_symmetric(bones: Arrays) -> None:
    lines = bones["ribs/centreline"]
    np.testing.assert_array_equal(lines[12:], lines[:12] * MIRROR)
    for key in (key for key in bones if key.startswith("girdle/")):
        np.testing.assert_array_equal(bones[key][1], bones[key][0] * MIRROR)
    rim = bones["pelvis/rim"]
    np.testing.assert_array_equal(np.roll(rim[::-1], 1, axis=0), rim * MIRROR)
    for key in ("centre", "top", "bottom", "process", "front"):
        np.testing.assert_allclose(bones[f"spine/{key}"][:, 1], 0.0, atol=1e-3)


@pytest.mark.parametrize("row", measurements(), ids=lambda row: f"{row['side']}{row['rib']}")
def test_rib_agrees_with_an_independent_measurement(bones: Arrays, row: dict[str, str]) -> None:
    line = bones["ribs/centreline"][RIBS.index(row["side"] + row["rib"])]
    for end, index in (("head", 0), ("tip", -1)):
        measured = [float(row[f"{end}_{axis}_mm"]) / 1000 for axis in "xyz"]
        assert np.linalg.norm(line[index] - measured) < 0.006
    assert arc_length(line) == pytest.approx(float(row["length_mm"]) / 1000, abs=0.005)


@pytest.mark.parametrize("number", range(3, 11))
def test_rib_length_against_the_published_table(bones: Arrays, number: int) -> None:
    row = next(row for row in measurements() if row["rib"] == str(number))
    published = float(row["length_table_at_1700mm"]) / 1000
    assert arc_length(bones["ribs/centreline"][number - 1]) == pytest.approx(published, rel=0.12)


def test_rib_points_are_equally_spaced(bones: Arrays) -> None:
    for line in bones["ribs/centreline"]:
        step = np.linalg.norm(np.diff(line, axis=0), axis=1)
        np.testing.assert_allclose(step, step.mean(), rtol=0.02)


@pytest.mark.parametrize("name", RIBS)
def test_centreline_runs_inside_its_rib(bones: Arrays, name: str) -> None:
    line = bones["ribs/centreline"][RIBS.index(name)]
    vertices = bones[f"mesh/rib_{name}/vertices"]
    nearest = np.linalg.norm(line[:, None] - vertices[None], axis=2).min(axis=1)
    assert nearest.max() < 0.013
    assert (line > vertices.min(axis=0) - 0.003).all()
    assert (line < vertices.max(axis=0) + 0.003).all()


def test_spine_stacks_from_atlas_to_sacrum(bones: Arrays) -> None:
    top, bottom = bones["spine/top"], bones["spine/bottom"]
    assert [str(name) for name in bones["spine/name"]] == [*LEVELS, "S1"]
    assert (np.diff(bones["spine/centre"][:, 2]) < 0).all()
    disc = np.linalg.norm(bottom[:-1] - top[1:], axis=1)
    assert disc[0] == 0.0
    assert (disc[1:] > 0.001).all()
    assert (disc < 0.011).all()
    body = np.linalg.norm(top[:-1] - bottom[:-1], axis=1)
    assert (body[2:] > 0.009).all()
    assert (body < 0.030).all()
    centre = bones["spine/centre"]
    assert arc_length(centre[7:19]) == pytest.approx(0.257, abs=0.005)
    assert arc_length(centre[19:24]) == pytest.approx(0.118, abs=0.003)


def test_process_lies_behind_and_front_before_the_body(bones: Arrays) -> None:
    centre = bones["spine/centre"]
    assert (centre[:, 0] - bones["spine/process"][:, 0] > 0.02).all()
    assert (bones["spine/front"][:, 0] - centre[:, 0] > 0.004).all()


@pytest.mark.parametrize("number", range(1, 13))
def test_rib_head_lies_at_its_vertebra_or_the_one_above(bones: Arrays, number: int) -> None:
    head = bones["ribs/centreline"][number - 1, 0]
    distance = {
        level: np.linalg.norm(bones[f"mesh/{level}/vertices"] - head, axis=1).min()
        for level in LEVELS
    }
    place = LEVELS.index(f"T{number}")
    closest = min(LEVELS, key=lambda level: distance[level])
    assert closest in LEVELS[place - 1 : place + 1]
    assert distance[closest] < 0.012


def test_sternum_and_pelvis_landmarks(bones: Arrays) -> None:
    front, back = bones["sternum/outline"]
    assert front[0, 2] - front[-1, 2] == pytest.approx(0.177, abs=0.003)
    assert arc_length(front) == pytest.approx(0.188, abs=0.004)
    assert (front[:, 0] > back[:, 0]).all()
    level = dict(zip(bones["spine/name"], bones["spine/centre"], strict=True))
    mark = dict(zip(bones["pelvis/landmark_name"], bones["pelvis/landmarks"], strict=True))
    assert level["L5"][2] < mark["crest_top_L"][2] < level["L4"][2]
    assert mark["pubis"][2] < mark["ASIS_L"][2] < mark["crest_top_L"][2]
    assert mark["PSIS_L"][0] < level["L5"][0] < mark["ASIS_L"][0]
    rim = bones["pelvis/rim"]
    assert np.linalg.norm(rim - mark["ASIS_L"], axis=1).min() < 1e-9
    assert rim[1:20, 1].min() > 0


def test_notice_names_the_bones() -> None:
    assert "myo-sim" in (ROOT / "NOTICE").read_text()
