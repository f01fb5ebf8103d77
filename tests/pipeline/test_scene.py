"""What a page is given can be read back, within the error that the page states."""

from __future__ import annotations

import base64
import json
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from pipeline import packing, scene
from pipeline.view import script, write_view
from sim.errors import InputError
from sim.motion import skin_surface
from sim.trajectory import save_motion


class Reader:
    """Reads packed numbers as the page does."""

    def __init__(self, text):
        self.data = zlib.decompress(base64.b64decode(text))

    def whole(self, place):
        count = int(np.prod(place["shape"]))
        found = np.frombuffer(self.data, place["type"], count, place["at"]).reshape(place["shape"])
        return np.cumsum(found, axis=0, dtype=found.dtype) if place.get("steps") else found

    def values(self, place):
        return np.array(place["low"]) + np.array(place["scale"]) * self.whole(place)


@given(arrays(np.int16, (7, 3), elements=st.integers(-32767, 32767)))
def test_steps_are_summed_up_again(values):
    packer = packing.Packer()
    packer.add(np.arange(3, dtype=np.uint8))
    place = packer.add(values, differences=True)
    assert np.array_equal(Reader(packer.text()).whole(place), values)


@given(arrays(np.float64, (9, 4, 3), elements=st.floats(-2, 2)))
def test_components_keep_every_point_within_the_tolerance(points):
    modes = packing.principal(points, 1e-3)
    moves = modes.weights.values() @ (modes.scale[:, None] * modes.shapes)
    seen = modes.mean.values() + moves.reshape(points.shape)
    away = np.linalg.norm(seen - points, axis=-1).max()
    assert away == pytest.approx(modes.error, abs=1e-9)
    assert modes.error <= 1e-3


def test_points_that_do_not_move_need_no_component():
    points = np.repeat(np.random.default_rng(1).normal(size=(1, 5, 3)), 4, axis=0)
    assert packing.principal(points, 2e-4).shapes.shape == (0, 15)


@pytest.fixture(scope="module")
def packed(small_motion):
    made = scene.build_scene({"one": small_motion}, place="one.h5")
    told = json.loads(made.description)["trajectories"][0]
    return made, told, Reader(made.data)


def _posed(told, reader):
    position = reader.values(told["bodies"]["position"])
    quaternion = reader.values(told["bodies"]["quaternion"])
    turn = Rotation.from_quat(quaternion.reshape(-1, 4), scalar_first=True).as_matrix()
    return position, turn.reshape(*quaternion.shape[:2], 3, 3)


def _pool(told, reader):
    position, turn = _posed(told, reader)
    body, local = reader.whole(told["points"]["body"]), reader.values(told["points"]["local"])
    riding = position[:, body] + np.einsum("fpij,pj->fpi", turn[:, body], local)
    free = told["points"]["free"]
    shapes = np.array(free["scale"])[:, None] * reader.whole(free["shapes"])
    moves = (reader.values(free["weights"]) @ shapes).reshape(len(position), -1, 3)
    return np.concatenate([riding, reader.values(free["mean"]) + moves], axis=1)


def test_surfaces_and_fibres_are_where_they_should_be(packed, small_motion):
    made, told, reader = packed
    pool = _pool(told, reader)
    for surface in told["surfaces"]:
        index = reader.whole(surface["points"])
        away = pool[:, index] - small_motion.soft[surface["layer"]].vertices
        assert np.linalg.norm(away, axis=-1).max() <= made.error
    ends = pool[:, reader.whole(told["muscles"]["ends"])]
    away = np.linalg.norm(ends - small_motion.elements.endpoints, axis=-1)
    assert away.max() <= made.error < 3e-4


def test_the_skin_follows_in_the_page_within_the_stated_error(dressed_motion):
    """Read as the page does: v = sum of w times where each handle alone would take it."""
    made = scene.build_scene({"one": dressed_motion}, place="one.h5")
    told, reader = json.loads(made.description)["trajectories"][0], Reader(made.data)
    assert [s["layer"] for s in told["surfaces"]].count("skin") == 1
    skin = told["surfaces"][-1]["skin"]
    position, turn = _posed(told, reader)
    start = Rotation.from_quat(skin["quaternion"], scalar_first=True).as_matrix()
    moves = turn @ start.transpose(0, 2, 1)
    shifts = position - np.einsum("fbij,bj->fbi", moves, skin["position"])
    soft = _pool(told, reader)[:, reader.whole(skin["follow"])] - reader.values(skin["start"])
    rest, handle = reader.values(skin["rest"]), reader.whole(skin["handle"]).astype(int)
    row = np.repeat(np.arange(len(rest)), reader.whole(skin["count"]))
    weight = reader.whole(skin["weight"]) / 65535
    assert np.allclose(np.bincount(row, weight), 1.0)
    alone = np.empty((len(position), len(row), 3))
    on = handle < len(start)
    alone[:, on] = np.einsum("fpij,pj->fpi", moves[:, handle[on]], rest[row[on]])
    alone[:, on] += shifts[:, handle[on]]
    alone[:, ~on] = rest[row[~on]] + soft[:, handle[~on] - len(start)]
    places = np.zeros((len(position), len(rest), 3))
    np.add.at(places, (slice(None), row), weight[:, None] * alone)
    away = places - skin_surface(dressed_motion).vertices
    assert np.linalg.norm(away, axis=-1).max() <= made.error < 3e-4


def test_a_point_on_a_bone_rides_on_it(packed):
    _, told, reader = packed
    body = reader.whole(told["points"]["body"])
    # two ends of fibres ride on the rib; what does not move at all rides on the pelvis
    assert sorted(set(body.tolist())) == [0, 2]
    assert (body == 2).sum() == 2


def test_bones_turn_within_the_stated_error(packed, small_motion):
    made, told, reader = packed
    position, turn = _posed(told, reader)
    truth = Rotation.from_quat(small_motion.quaternion.reshape(-1, 4), scalar_first=True)
    truth = truth.as_matrix().reshape(turn.shape)
    for shape in told["bodies"]["shapes"]:
        b, own = shape["body"], small_motion.shapes[shape["name"]]
        seen = position[:, b, None] + np.einsum(
            "fij,pj->fpi", turn[:, b], reader.values(shape["vertices"])
        )
        right = small_motion.position[:, b, None] + np.einsum(
            "fij,pj->fpi", truth[:, b], own.vertices
        )
        assert np.linalg.norm(seen - right, axis=-1).max() <= made.error


def test_tension_is_kept_on_a_root_scale(packed, small_motion):
    _, told, reader = packed
    muscles = told["muscles"]
    seen = muscles["most_n"] * (reader.whole(muscles["tension"]) / 255) ** 2
    assert np.abs(seen - small_motion.elements.tension).max() < 0.01 * muscles["most_n"]


def test_no_name_ends_the_element_that_holds_the_scene(packed):
    made, _, _ = packed
    assert "<" not in made.description
    assert "</script" not in script()


def test_a_marker_without_measured_places_is_told(small_motion):
    from dataclasses import replace

    measured = small_motion.measured.copy()
    measured[3, 1] = np.nan
    made = scene.build_scene({"one": replace(small_motion, measured=measured)}, place="one.h5")
    told = json.loads(made.description)["trajectories"][0]
    assert told["markers"]["seen"] == [True, False, True]


def test_a_run_too_long_for_a_page_is_refused(small_motion, monkeypatch):
    monkeypatch.setattr(scene, "MOST_FRAMES", 10)
    with pytest.raises(InputError, match=r"one\.h5: 2 s are too long for a page"):
        scene.build_scene({"one": small_motion}, place="one.h5")


def test_a_long_run_keeps_each_second_frame(small_motion, monkeypatch):
    monkeypatch.setattr(scene, "MOST_FRAMES", 26)
    made = scene.build_scene({"one": small_motion}, place="one.h5")
    assert made.rate == pytest.approx(12.5)


def test_a_page_stands_alone(small_motion, tmp_path):
    path = tmp_path / "small.h5"
    save_motion(path, small_motion, {"style": "calm", "posture": "upright"})
    text = write_view([path], tmp_path / "small.html").read_text(encoding="utf-8")
    assert text.count("<script") == text.count("</script>") == 4
    assert "http" not in text.split("<script")[0].replace("http-equiv", "")


def test_a_clock_may_begin_before_the_first_frame_and_end_after_the_last(small_motion):
    late = replace(small_motion, time=small_motion.time + 3.0)
    made = scene.build_scene({"late": late}, place="late.h5", span=(2.5, 9.0))
    told = json.loads(made.description)
    begun = float(late.time[0])
    assert (told["start"], told["duration"]) == (2.5, 6.5)
    assert told["trajectories"][0]["delay"] == pytest.approx(begun - 2.5, abs=1e-4)


def test_without_a_span_each_trajectory_begins_with_its_first_frame(small_motion):
    late = replace(small_motion, time=small_motion.time + 3.0)
    made = scene.build_scene({"one": small_motion, "late": late}, place="late.h5")
    told = json.loads(made.description)
    assert [one["delay"] for one in told["trajectories"]] == [0.0, 0.0]
    assert told["duration"] == pytest.approx(float(np.ptp(small_motion.time)), abs=1e-4)
