"""The trajectory file: what is written is read back, and volumes follow from the faces."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.control.library import find_controls
from sim.errors import InputError
from sim.motion import Motion, motion, volumes_inside
from sim.resting import RestingTorso
from sim.simulate import simulate
from sim.trajectory import load_motion, save_motion

ABOUT: dict[str, str | int] = {
    "version": "0.1.0", "seed": 3, "style": "calm", "subject": "nobody", "posture": "upright",
}  # fmt: skip
DURATION = 0.8
RATE = 25.0


@pytest.fixture(scope="module")
def moved(resting: RestingTorso) -> Motion:
    activation = find_controls("calm").drive(DURATION).activation
    run = simulate(resting, activation, posture="upright", rate=RATE, tension=True)
    return motion(resting, run, posture="upright")


@pytest.fixture(scope="module")
def written(moved: Motion, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("trajectory") / "new" / "calm.h5"
    save_motion(path, moved, ABOUT)
    return path


def _volume(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Divergence theorem, without the code under test."""
    a, b, c = (vertices[:, faces[:, k]] for k in range(3))
    return np.einsum("tfi,tfi->t", a, np.cross(b, c)) / 6.0


@pytest.mark.parametrize("part", ["abdomen", "chest_cavity"])
def test_volume_follows_from_the_faces(written: Path, part: str) -> None:
    with h5py.File(written) as file:
        vertices, faces = file[f"soft/{part}/vertices"][:], file[f"soft/{part}/faces"][:]
        stated = file[f"volumes/{part}"][:]
    np.testing.assert_allclose(_volume(vertices, faces), stated, rtol=1e-12)


def test_lung_is_chest_without_tissue(written: Path) -> None:
    with h5py.File(written) as file:
        lung, chest = file["volumes/lung"], file["volumes/chest_cavity"]
        np.testing.assert_allclose(lung[:] + lung.attrs["tissue_volume"], chest[:], rtol=1e-14)
        assert lung[-1] > lung[0]


def test_replayed_volumes_are_those_of_the_run(resting: RestingTorso, moved: Motion) -> None:
    activation = find_controls("calm").drive(DURATION).activation
    run = simulate(resting, activation, posture="upright", rate=RATE)
    # the run's volumes are those at the predicted place of a step, a little off the reached one
    np.testing.assert_allclose(moved.volumes["chest_cavity"], run.chest, atol=1e-6)
    np.testing.assert_allclose(moved.volumes["abdomen"], run.abdomen, atol=1e-6)


@pytest.mark.parametrize("part", ["abdomen", "chest_cavity"])
def test_cavities_are_closed(moved: Motion, part: str) -> None:
    faces = moved.soft[part].faces
    edges = [(i, j) for f in faces.tolist() for i, j in zip(f, [*f[1:], f[0]], strict=True)]
    assert len(set(edges)) == len(edges)
    assert {(j, i) for i, j in edges} == set(edges)
    assert (volumes_inside(moved.soft[part]) > 0).all()


def test_both_cavities_end_with_the_diaphragm(moved: Motion) -> None:
    dome = moved.soft["diaphragm"]
    shape = dome.vertices[0][dome.faces]
    for part in ("abdomen", "chest_cavity"):
        soft = moved.soft[part]
        tail = soft.vertices[0][soft.faces[-len(dome.faces) :]]
        ours, theirs = (np.sort(x.mean(axis=1), axis=0) for x in (shape, tail))
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_elements_pull_between_points_of_the_torso(moved: Motion) -> None:
    elements = moved.elements
    assert elements is not None
    assert elements.tension.shape == (len(moved.time), len(elements.group))
    assert elements.endpoints.shape == (*elements.tension.shape, 2, 3)
    assert (elements.tension >= 0).all()
    diaphragm = np.array(elements.group) == "diaphragm"
    force = elements.tension[:, diaphragm].sum(axis=1)
    assert force[-1] > force[0]


def test_everything_comes_back(written: Path, moved: Motion) -> None:
    back, about = load_motion(written)
    assert {k: about[k] for k in ABOUT} == ABOUT
    assert (back.bodies, back.marker_names) == (moved.bodies, moved.marker_names)
    for name in ("time", "position", "quaternion", "markers"):
        np.testing.assert_array_equal(getattr(back, name), getattr(moved, name))
    for name, soft in moved.soft.items():
        np.testing.assert_array_equal(back.soft[name].vertices, soft.vertices)
        np.testing.assert_array_equal(back.soft[name].faces, soft.faces)
    for name, pressure in moved.pressures.items():
        np.testing.assert_array_equal(back.pressures[name], pressure)
    assert back.elements is not None and moved.elements is not None
    assert back.elements.group == moved.elements.group
    np.testing.assert_allclose(back.elements.tension, moved.elements.tension, rtol=1e-6)


def test_every_number_has_a_unit(written: Path) -> None:
    missing = []

    def visit(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fi" and not item.attrs["unit"]:
            missing.append(name)

    with h5py.File(written) as file:
        file.visititems(visit)
        assert file["pressures/pleural"].attrs["unit"] == "Pa"
    assert missing == []


def test_a_failed_write_leaves_nothing(moved: Motion, tmp_path: Path) -> None:
    path = tmp_path / "calm.h5"
    with pytest.raises(TypeError):
        save_motion(path, moved, {"version": object()})  # type: ignore[dict-item]
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_is_no_folder_is_one_line(moved: Motion, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"^.*calm\.h5: cannot be written .*place\.$"):
        save_motion(tmp_path / "file" / "calm.h5", moved, ABOUT)


def test_what_is_no_trajectory_is_refused(tmp_path: Path, written: Path) -> None:
    cut = tmp_path / "cut.h5"
    cut.write_bytes(written.read_bytes()[:5000])
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["x"] = 1.0
    for path in (cut, other, tmp_path / "missing.h5"):
        with pytest.raises(InputError) as raised:
            load_motion(path)
        assert str(path) in str(raised.value) and "\n" not in str(raised.value)


def test_a_file_holds_all_that_is_drawn(written: Path, moved: Motion) -> None:
    read, _ = load_motion(written)
    assert read.parents == moved.parents
    assert read.measured is None
    assert read.shapes.keys() == moved.shapes.keys()
    for name, shape in moved.shapes.items():
        kept = read.shapes[name]
        assert (kept.body, kept.tissue) == (shape.body, shape.tissue)
        np.testing.assert_allclose(kept.vertices, shape.vertices, atol=1e-7)
        np.testing.assert_array_equal(kept.faces, shape.faces)


def test_bodies_keep_their_joints(moved: Motion) -> None:
    """A body that is carried turns about a fixed place in the frame of what carries it."""
    turn = Rotation.from_quat(moved.quaternion.reshape(-1, 4), scalar_first=True).as_matrix()
    turn = turn.reshape(*moved.quaternion.shape[:2], 3, 3)
    for b, parent in enumerate(moved.parents):
        if parent:
            up = moved.bodies.index(parent)
            away = moved.position[:, b] - moved.position[:, up]
            own = np.einsum("fji,fj->fi", turn[:, up], away)
            assert np.ptp(own, axis=0).max() < 1e-9
