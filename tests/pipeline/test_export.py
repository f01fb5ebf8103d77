"""Exports against the trajectory, read by others' readers."""

from __future__ import annotations

from dataclasses import replace

import ezc3d
import numpy as np
import pytest
from pygltflib import GLTF2
from scipy.spatial.transform import Rotation

from pipeline.__main__ import main
from pipeline.export import export
from sim.trajectory import save_motion

FRAMES = (0, 17, 50)


@pytest.fixture(scope="module")
def exported(small_motion, tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    source = folder / "small.h5"
    named = replace(small_motion, marker_names=("STRN", "NAVEL", "T10"))
    save_motion(source, named, {"style": "calm", "version": "0", "seed": 1})
    for ending in (".glb", ".c3d", ".bvh"):
        export(source, folder / f"small{ending}")
    return folder


@pytest.fixture(scope="module")
def usd_stage(exported):
    usd = pytest.importorskip("pxr.Usd", reason="no usd-core: pip install '.[usd]'")
    export(exported / "small.h5", exported / "small.usdc")
    return usd.Stage.Open(str(exported / "small.usdc"))


@pytest.fixture(scope="module")
def archive(exported):
    abc = pytest.importorskip("alembic3d", reason="no alembic3d: pip install '.[alembic]'")
    export(exported / "small.h5", exported / "small.abc")
    return abc.Abc.IArchive(str(exported / "small.abc"))


class Glb:
    """A GLB file as pygltflib reads it, with its animation applied."""

    def __init__(self, path):
        self.gltf = GLTF2().load_binary(str(path))
        self.blob = self.gltf.binary_blob()

    def array(self, index):
        accessor = self.gltf.accessors[index]
        view = self.gltf.bufferViews[accessor.bufferView]
        kind = {5126: np.float32, 5123: np.uint16}[accessor.componentType]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
        found = np.frombuffer(self.blob, kind, accessor.count * width, view.byteOffset)
        return found.reshape(-1, width)

    def node(self, name):
        return next(k for k, node in enumerate(self.gltf.nodes) if node.name == name)

    def track(self, name, path):
        animation, node = self.gltf.animations[0], self.node(name)
        channel = next(
            c for c in animation.channels if c.target.node == node and c.target.path == path
        )
        return self.array(animation.samplers[channel.sampler].output)

    def primitive(self, name):
        return self.gltf.meshes[self.gltf.nodes[self.node(name)].mesh].primitives[0]


def y_up(points):
    """X left, Y up, Z forward."""
    return np.stack([points[..., 1], points[..., 2], points[..., 0]], axis=-1)


def bone_points(motion, name, frame):
    b = motion.bodies.index(name)
    turn = Rotation.from_quat(motion.quaternion[frame, b], scalar_first=True)
    return turn.apply(motion.shapes[name].vertices) + motion.position[frame, b]


@pytest.mark.parametrize("frame", FRAMES)
def test_bones_of_the_glb_are_where_the_trajectory_has_them(exported, small_motion, frame):
    glb = Glb(exported / "small.glb")
    for name in small_motion.bodies:
        turn = Rotation.from_quat(glb.track(name, "rotation")[frame])
        own = glb.array(glb.primitive(name).attributes.POSITION)
        seen = turn.apply(own) + glb.track(name, "translation")[frame]
        assert np.allclose(seen, y_up(bone_points(small_motion, name, frame)), atol=1e-6)


@pytest.mark.parametrize("frame", FRAMES)
def test_soft_surfaces_of_the_glb_are_within_their_error(exported, small_motion, frame):
    glb = Glb(exported / "small.glb")
    for name, soft in small_motion.soft.items():
        primitive = glb.primitive(name)
        moves = np.array([glb.array(t["POSITION"]) for t in primitive.targets])
        weights = glb.track(name, "weights").reshape(len(small_motion.time), -1)
        assert weights.min() >= 0 and weights.max() <= 1
        seen = glb.array(primitive.attributes.POSITION) + np.tensordot(weights[frame], moves, 1)
        away = np.linalg.norm(seen - y_up(soft.vertices[frame]), axis=-1)
        assert away.max() < 3e-4
        faces = glb.array(primitive.indices).reshape(-1, 3)
        assert np.array_equal(faces, soft.faces)


def test_glb_time_starts_at_nothing_and_markers_ride_along(exported, small_motion):
    glb = Glb(exported / "small.glb")
    time = glb.array(glb.gltf.animations[0].samplers[0].input)[:, 0]
    assert np.allclose(time, small_motion.time - small_motion.time[0], atol=1e-6)
    assert np.allclose(
        glb.track("marker_T10", "translation"), y_up(small_motion.markers[:, 2]), atol=1e-6
    )


def test_c3d_has_the_markers_in_millimetres(exported, small_motion):
    read = ezc3d.c3d(str(exported / "small.c3d"))
    point = read["parameters"]["POINT"]
    assert point["LABELS"]["value"] == ["STRN", "NAVEL", "T10"]
    assert point["UNITS"]["value"] == ["mm"]
    assert point["RATE"]["value"][0] == pytest.approx(25.0)
    seen = np.moveaxis(read["data"]["points"][:3], (0, 1, 2), (2, 1, 0))
    assert np.allclose(seen, 1e3 * small_motion.markers, atol=1e-3)


def read_bvh(text):
    """Joints as (name, parent, offset, channels) and the rows of motion."""
    joints, stack, words = [], [], text.split()
    k = 0
    while words[k] != "MOTION":
        word = words[k]
        if word in ("ROOT", "JOINT"):
            joints.append([words[k + 1], stack[-1] if stack else None, None, []])
            current = len(joints) - 1
        elif word == "End":
            current = None
        elif word == "{":
            stack.append(current)
        elif word == "}":
            stack.pop()
        elif word == "OFFSET" and stack[-1] is not None:
            joints[stack[-1]][2] = np.array([float(v) for v in words[k + 1 : k + 4]])
        elif word == "CHANNELS":
            n = int(words[k + 1])
            joints[stack[-1]][3] = words[k + 2 : k + 2 + n]
        k += 1
    numbers = [float(v) for v in words[k + 6 :]]
    return joints, np.array(numbers).reshape(int(words[k + 2]), -1)


def pose_bvh(joints, row):
    """World place and turn of every joint by the usual rule: turns in the channels' order."""
    out, start = {}, 0
    for name, parent, offset, channels in joints:
        values = row[start : start + len(channels)]
        start += len(channels)
        place, turn = offset.copy(), Rotation.identity()
        for channel, value in zip(channels, values, strict=True):
            axis = "XYZ".index(channel[0])
            if channel.endswith("position"):
                place[axis] = value
            else:
                turn = turn * Rotation.from_rotvec(np.radians(value) * np.eye(3)[axis])
        if parent is not None:
            above, way = out[joints[parent][0]]
            place, turn = above + way.apply(place), way * turn
        out[name] = (place, turn)
    return out


@pytest.mark.parametrize("frame", FRAMES)
def test_joints_of_the_bvh_are_where_the_bodies_are(exported, small_motion, frame):
    joints, rows = read_bvh((exported / "small.bvh").read_text())
    assert len(rows) == len(small_motion.time)
    pose = pose_bvh(joints, rows[frame])
    for b, name in enumerate(small_motion.bodies):
        place, turn = pose[name]
        assert np.allclose(place, 100 * y_up(small_motion.position[frame, b]), atol=1e-3)
        points = turn.apply(y_up(small_motion.shapes[name].vertices)) + place / 100
        assert np.allclose(points, y_up(bone_points(small_motion, name, frame)), atol=1e-5)


def test_a_joint_that_stays_in_its_parent_has_no_place_in_the_bvh(exported):
    joints, _ = read_bvh((exported / "small.bvh").read_text())
    assert [len(channels) for *_, channels in joints] == [6, 3, 3]


# frame 1 is a turn of a milliradian, which a single quaternion loses
@pytest.mark.parametrize("frame", (*FRAMES, 1))
def test_bones_of_the_usd_are_where_the_trajectory_has_them(usd_stage, small_motion, frame):
    geom = pytest.importorskip("pxr.UsdGeom")
    for name in small_motion.bodies:
        body = f"/torso/bodies/{name.replace('-', '_')}"
        mesh = usd_stage.GetPrimAtPath(f"{body}/{name.replace('-', '_')}")
        own = np.array(geom.Mesh(mesh).GetPointsAttr().Get(frame))
        matrix = np.array(geom.XformCache(frame).GetLocalToWorldTransform(mesh))
        seen = own @ matrix[:3, :3] + matrix[3, :3]
        assert np.allclose(seen, bone_points(small_motion, name, frame), atol=1e-6)
        assert usd_stage.GetPrimAtPath(body).GetDisplayName() == name


@pytest.mark.parametrize("frame", FRAMES)
def test_soft_surfaces_and_markers_of_the_usd_are_those_of_the_trajectory(
    usd_stage, small_motion, frame
):
    geom = pytest.importorskip("pxr.UsdGeom")
    for name, soft in small_motion.soft.items():
        mesh = geom.Mesh(usd_stage.GetPrimAtPath(f"/torso/soft/{name}"))
        seen = np.array(mesh.GetPointsAttr().Get(frame))
        assert np.allclose(seen, soft.vertices[frame], atol=1e-6)
        faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        assert np.array_equal(faces, soft.faces)
    marker = usd_stage.GetPrimAtPath("/torso/markers/NAVEL")
    place = geom.XformCache(frame).GetLocalToWorldTransform(marker).ExtractTranslation()
    assert np.allclose(place, small_motion.markers[frame, 1], atol=1e-9)


def test_usd_states_its_units_axes_and_clock(usd_stage, small_motion):
    geom = pytest.importorskip("pxr.UsdGeom")
    assert geom.GetStageMetersPerUnit(usd_stage) == 1.0
    assert geom.GetStageUpAxis(usd_stage) == "Z"
    assert usd_stage.GetTimeCodesPerSecond() == pytest.approx(25.0)
    assert usd_stage.GetEndTimeCode() == len(small_motion.time) - 1
    assert usd_stage.GetDefaultPrim().GetPath() == "/torso"


def test_muscles_of_the_usd_grow_with_their_tension(usd_stage, small_motion):
    geom = pytest.importorskip("pxr.UsdGeom")
    curves = geom.BasisCurves(usd_stage.GetPrimAtPath("/torso/muscles/diaphragm"))
    slack, tight = (np.array(curves.GetWidthsAttr().Get(frame)) for frame in (0, 25))
    assert tight[0] > 2 * slack[0]
    ends = np.array(curves.GetPointsAttr().Get(25))
    assert np.allclose(ends, small_motion.elements.endpoints[25, 0], atol=1e-6)


def test_usd_as_text_holds_the_same(usd_stage, exported):
    usd = pytest.importorskip("pxr.Usd")
    export(exported / "small.h5", exported / "small.usda")
    text = usd.Stage.Open(str(exported / "small.usda"))
    paths = [str(prim.GetPath()) for prim in text.Traverse()]
    assert paths == [str(prim.GetPath()) for prim in usd_stage.Traverse()]
    assert (exported / "small.usda").read_bytes().startswith(b"#usda")


def at_frame(schema, frame):
    """What an Alembic schema holds at a frame, asked for by its time."""
    from alembic3d import Abc

    time = schema.getTimeSampling().getSampleTime(frame)
    return schema.getValue(Abc.ISampleSelector(time))


def points_of(mesh, frame):
    """Vertices of an Alembic mesh, and its faces."""
    sample = at_frame(mesh.getSchema(), frame)
    points = np.array([(p.x, p.y, p.z) for p in sample.getPositions()])
    return points, np.array(list(sample.getFaceIndices())).reshape(-1, 3)


@pytest.mark.parametrize("frame", FRAMES)
def test_alembic_is_where_the_trajectory_is(archive, small_motion, frame):
    from alembic3d import AbcGeom

    root = AbcGeom.IXform(archive.getTop(), "torso")
    for name in small_motion.bodies:
        body = AbcGeom.IXform(root, name)
        rows = at_frame(body.getSchema(), frame).getMatrix()
        matrix = np.array([[rows[i][j] for j in range(4)] for i in range(4)])
        own, _ = points_of(AbcGeom.IPolyMesh(body, name), 0)
        seen = own @ matrix[:3, :3] + matrix[3, :3]
        assert np.allclose(seen, y_up(bone_points(small_motion, name, frame)), atol=1e-6)
    for name, soft in small_motion.soft.items():
        mesh = AbcGeom.IPolyMesh(root, name)
        seen, faces = points_of(mesh, frame)
        assert np.allclose(seen, y_up(soft.vertices[frame]), atol=1e-6)
        # wound the other way round, as this format has it
        assert np.array_equal(faces[:, ::-1], soft.faces)
        time = mesh.getSchema().getTimeSampling().getSampleTime(frame)
        assert time == pytest.approx(small_motion.time[frame] - small_motion.time[0])


@pytest.mark.parametrize(("ending", "extra"), [(".usdc", "usd"), (".abc", "alembic")])
def test_a_library_that_is_lacking_is_named(exported, monkeypatch, capsys, ending, extra):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    out = exported / f"lacking{ending}"
    assert main(["export", str(exported / "small.h5"), "--to", str(out)]) == 1
    told = capsys.readouterr().err
    assert f"pip install -c requirements.lock '.[{extra}]'" in told and told.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("source", "target", "says"),
    [
        ("small.h5", "out.fbx", "out.fbx: unknown ending. Use one of .glb, .c3d, .bvh, .abc,"),
        ("none.h5", "out.glb", "none.h5: there is no such file."),
        ("small.bvh", "out.glb", "small.bvh: is not a trajectory of the torso"),
        ("small.h5", "small.h5/out.glb", "out.glb: cannot be written"),
    ],
)
def test_bad_requests_are_one_line(exported, monkeypatch, capsys, source, target, says):
    monkeypatch.chdir(exported)
    before = sorted(exported.iterdir())
    assert main(["export", source, "--to", target]) == 1
    told = capsys.readouterr().err
    assert says in told and told.count("\n") == 1
    assert sorted(exported.iterdir()) == before
