"""A mesh of one's own: read, brought to its place, or refused in one line."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from pipeline import mesh_reading
from pipeline.mesh_reading import read_landmarks, read_mesh
from pipeline.own_mesh import own_skin, similarity
from pipeline.skin_command import SkinTask, run_skin
from sim.errors import InputError, ParameterError
from sim.model.anatomy import Subject
from sim.motion import dressed, rest_motion
from sim.resting import rest_torso
from sim.skin.clearance import depths
from sim.skin.frame import underneath
from sim.trajectory import save_motion


def _box(tall=1.0):
    box = trimesh.creation.box((0.4 * tall, tall, 0.2 * tall))
    return box.subdivide()


@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_both_kinds_are_read_in_our_axes(tmp_path, kind):
    path = tmp_path / f"box.{kind}"
    _box().export(path)
    vertices, faces = read_mesh(path, "m", "y")
    # Y is up in the file, Z forward: 0.4 broad, 1 high, 0.2 deep
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.2, 0.4, 1.0], atol=1e-6)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert np.einsum("ti,ti->", a, np.cross(b, c)) / 6 == pytest.approx(0.08, rel=1e-5)


def test_z_up_is_minus_y_forward(tmp_path):
    path = tmp_path / "box.obj"
    box = _box()
    box.vertices = box.vertices[:, [0, 2, 1]] * [1, -1, 1]
    box.export(path)
    vertices, _ = read_mesh(path, "m", "z")
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.2, 0.4, 1.0], atol=1e-6)


def test_seams_are_welded(tmp_path):
    path = tmp_path / "seam.obj"
    box = _box()
    corners, index = box.vertices[box.faces].reshape(-1, 3), np.arange(3 * len(box.faces))
    loose = trimesh.Trimesh(corners, index.reshape(-1, 3), process=False)
    loose.export(path)
    vertices, _ = read_mesh(path, "m", "y")
    assert len(vertices) == len(box.vertices)


@given(
    turn=st.tuples(*[st.floats(-1, 1)] * 3),
    scale=st.floats(0.5, 2),
    shift=st.tuples(*[st.floats(-1, 1)] * 3),
)
@settings(max_examples=30)
def test_a_planted_similarity_is_found(turn, scale, shift):
    source = np.random.default_rng(5).normal(size=(12, 3))
    whole = Rotation.from_rotvec(turn)
    found = similarity(source, scale * whole.apply(source) + shift)
    assert found[0] == pytest.approx(scale)
    np.testing.assert_allclose(found[1], whole.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(found[2], shift, atol=1e-9)


def _refused(path, words, unit="m"):
    with pytest.raises(InputError, match=words) as found:
        read_mesh(path, unit, "y")
    assert "\n" not in str(found.value) and path.name in str(found.value)


def test_the_wrong_unit_is_told_with_the_right_one(tmp_path):
    path = tmp_path / "mm.obj"
    _box(1000.0).export(path)
    _refused(path, r"1e\+03 m high with --unit m.*Give --unit mm")
    assert np.ptp(read_mesh(path, "mm", "y")[0][:, 2]) == pytest.approx(1.0)


def test_a_text_named_glb_is_refused(tmp_path):
    path = tmp_path / "text.glb"
    path.write_text("hello")
    _refused(path, "is no GLB, whatever its ending")


def test_a_damaged_glb_is_refused(tmp_path):
    path = tmp_path / "half.glb"
    _box().export(path)
    path.write_bytes(path.read_bytes()[:200])
    _refused(path, "cannot be read as GLB")


def test_another_kind_is_refused(tmp_path):
    path = tmp_path / "box.stl"
    path.write_text("solid")
    _refused(path, r"unknown ending. Use .obj or .glb")
    _refused(tmp_path / "missing.obj", "Check its name")


@pytest.mark.parametrize("text", ["", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no mesh at all\n"])
def test_a_file_without_faces_is_refused(tmp_path, text):
    path = tmp_path / "points.obj"
    path.write_text(text)
    _refused(path, r"has no faces|cannot be read as OBJ")


def test_a_place_that_is_no_number_is_refused(tmp_path):
    path = tmp_path / "nan.obj"
    path.write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    _refused(path, "vertex 2 is not a number")


def test_too_many_vertices_are_refused_with_the_bound(tmp_path, monkeypatch):
    path = tmp_path / "box.obj"
    _box().export(path)
    monkeypatch.setattr(mesh_reading, "MOST_VERTICES", 10)
    _refused(path, "A skin may have 10")
    # ten million faces are not even read
    with path.open("r+b") as stream:
        stream.truncate(400_000_000)
    _refused(path, r"400 MB. A skin may have 10 vertices and 100 MB")


def test_landmarks_are_checked(tmp_path):
    known = {name: np.zeros(3) for name in ("notch", "navel", "c7", "pubis")}
    path = tmp_path / "landmarks.csv"

    def refused(text, words):
        path.write_text(text)
        with pytest.raises(InputError, match=words):
            read_landmarks(path, "m", "y", known)

    refused("a,b\n", "no columns landmark,x,y,z")
    refused("landmark,x,y,z\nknee,0,0,0\n", "line 2: no landmark 'knee'. There are: notch")
    refused("landmark,x,y,z\nnotch,0,zero,0\n", "line 2: x, y, z must be numbers")
    refused("landmark,x,y,z\nnotch,0,inf,0\n", "line 2: x, y, z must be numbers")
    refused("landmark,x,y,z\nnotch,0,0,0\n", "1 landmarks. Give at least 3, not near a line")
    line = "landmark,x,y,z\nnotch,0,0,0\nnavel,0,1,0\nc7,0,2,0\n"
    refused(line, "not near a line")
    path.write_text("landmark,x,y,z\nnotch,0,50,10\nnavel,0,10,10\nc7,0,55,-10\n")
    found = read_landmarks(path, "cm", "y", known)
    np.testing.assert_allclose(found["notch"], [0.1, 0.0, 0.5])


def test_a_request_that_cannot_be_met_is_one_line(tmp_path, small_motion, dressed_motion):
    run = tmp_path / "run.h5"
    save_motion(run, small_motion, {"style": "calm"})
    with pytest.raises(ParameterError, match="nothing to write"):
        run_skin(SkinTask(trajectory=run))
    with pytest.raises(ParameterError, match="Give --mesh too"):
        run_skin(SkinTask(trajectory=run, out=run, landmarks=tmp_path / "a.csv"))
    with pytest.raises(ParameterError, match="--fat-mm is 900"):
        run_skin(SkinTask(trajectory=run, out=run, fat_mm=900.0))
    with pytest.raises(ParameterError, match=r"Let it end in .h5"):
        run_skin(SkinTask(trajectory=run, out=tmp_path / "a.html"))
    with pytest.raises(InputError, match="has no rest pose"):
        run_skin(SkinTask(trajectory=run, binding=tmp_path / "b.csv"))
    save_motion(run, dressed_motion, {"style": "calm"})
    table, out = tmp_path / "b.csv", tmp_path / "new.h5"
    lines = run_skin(SkinTask(trajectory=run, binding=table))
    assert "120 vertices" in lines[0] and table.exists()
    assert str(out) in run_skin(SkinTask(trajectory=run, use=table, out=out))[-1]


@pytest.mark.slow
def test_a_moved_person_finds_its_place_over_the_bones(tmp_path):
    """The reference man's own skin, scaled, turned and shifted, comes back from a file."""
    resting = rest_torso(Subject(sex="male", stature=1.756, mass=75.0))
    motion = dressed(rest_motion(resting, "upright"))
    human = motion.skin
    turned = Rotation.from_rotvec([0.0, 0.05, 0.1]).apply(1.06 * human.vertices)
    turned = turned + np.array([0.2, 0.1, 0.9])
    path = tmp_path / "me.glb"
    # back to the file's axes: X left, Y up, Z forward
    trimesh.Trimesh(turned[:, [1, 2, 0]], human.faces, process=False).export(path)
    skin = own_skin(path, motion, unit="m", up="y", landmarks=None, method="smooth", fat_layer=None)
    away = cKDTree(skin.vertices).query(human.vertices)[0]
    assert np.median(away) < 0.003 and np.quantile(away, 0.99) < 0.015
    under = underneath(motion.rest, motion.shapes)
    assert depths(under.points, skin.vertices, skin.faces).depth.min() > 0.003
