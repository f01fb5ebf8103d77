"""A skin follows what it is bound to: weights, rigid motion, the published method."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from sim.motion import Motion, dressed, skin_surface
from sim.skin.binding import METHODS, MOST, NEAREST, NEIGHBOURS, Weights, fewest
from sim.skin.bound import BoundSkin
from sim.skin.clearance import depths, neighbours, push_out
from sim.skin.frame import bone_points
from sim.skin.storage import put_rest, put_skin, take_rest, take_skin


def _skin(motion: Motion, method: str) -> BoundSkin:
    assert motion.skin is not None and motion.rest is not None
    skin = motion.skin
    weights = METHODS[method](
        skin.vertices, skin.faces, motion.rest, motion.shapes, motion.soft["abdomen"].faces
    )
    return replace(skin, weights=weights)


@pytest.mark.parametrize("method", METHODS)
def test_weights_are_shares_and_sum_to_one(dressed_motion: Motion, method: str) -> None:
    weights = _skin(dressed_motion, method).weights
    assert (weights.weight >= 0).all()
    np.testing.assert_allclose(weights.weight.sum(axis=1), 1.0, atol=1e-12)
    assert weights.handle.max() < len(_skin(dressed_motion, method).rest.handles)
    assert weights.handle.shape[1] <= MOST


@pytest.mark.parametrize("method", METHODS)
@given(turn=st.tuples(*[st.floats(-3, 3)] * 3), shift=st.tuples(*[st.floats(-1, 1)] * 3))
@settings(max_examples=10)
def test_a_rigid_motion_of_everything_is_followed_exactly(
    dressed_motion: Motion, method: str, turn: tuple[float, ...], shift: tuple[float, ...]
) -> None:
    skin, whole = _skin(dressed_motion, method), Rotation.from_rotvec(turn)
    if method == NEAREST and np.any(turn):
        # a vertex of the belly only shifts what is bound to it, as printed
        whole = Rotation.identity()
    rest = skin.rest
    turned = whole * Rotation.from_quat(rest.quaternion, scalar_first=True)
    on_bones = skin.weights.handle < len(rest.bodies)
    places = skin.places(
        (whole.apply(rest.position) + shift)[None],
        turned.as_quat(scalar_first=True)[None],
        (whole.apply(rest.abdomen) + shift)[None],
    )[0]
    expected = whole.apply(skin.vertices) + shift
    bones = (np.where(on_bones, skin.weights.weight, 0.0).sum(axis=1) > 1 - 1e-9) | (
        whole.magnitude() < 1e-12
    )
    np.testing.assert_allclose(places[bones], expected[bones], atol=1e-9)


def test_at_rest_the_skin_is_where_it_was_laid(dressed_motion: Motion) -> None:
    skin = dressed_motion.skin
    assert skin is not None
    places = skin.places(
        skin.rest.position[None], skin.rest.quaternion[None], skin.rest.abdomen[None]
    )
    np.testing.assert_allclose(places[0], skin.vertices, atol=1e-12)


def test_dilorenzo_eq_8_1(dressed_motion: Motion) -> None:
    """Four nearest, a quarter each; a bone turns its point, a vertex shifts it."""
    skin, rest = _skin(dressed_motion, NEAREST), dressed_motion.rest
    assert rest is not None
    frame, vertex = 20, 7
    at = skin.vertices[vertex]
    far = {
        body: float(cKDTree(points).query(at)[0])
        for body, points in bone_points(rest, dressed_motion.shapes).items()
    }
    found: list[tuple[float, np.ndarray]] = []
    for body, away in far.items():
        b = rest.bodies.index(body)
        seen = Rotation.from_quat(rest.quaternion[b], scalar_first=True).inv()
        now = Rotation.from_quat(dressed_motion.quaternion[frame, b], scalar_first=True)
        local = seen.apply(at - rest.position[b])
        found.append((away, now.apply(local) + dressed_motion.position[frame, b]))
    belly = dressed_motion.soft["abdomen"].vertices[frame]
    for k, own in enumerate(rest.abdomen):
        found.append((float(np.linalg.norm(own - at)), belly[k] + at - own))
    nearest = sorted(found, key=lambda pair: pair[0])[:NEIGHBOURS]
    expected = np.mean([place for _, place in nearest], axis=0)
    moved = skin_surface(replace(dressed_motion, skin=skin)).vertices[frame, vertex]
    np.testing.assert_allclose(moved, expected, atol=1e-12)


def test_the_smooth_binding_stretches_less_than_the_published_one(dressed_motion: Motion) -> None:
    def worst(method: str) -> float:
        skin = _skin(dressed_motion, method)
        places = skin_surface(replace(dressed_motion, skin=skin)).vertices
        a, b = skin.faces[:, 0], skin.faces[:, 1]
        long = np.linalg.norm(places[:, a] - places[:, b], axis=2)
        return float(
            np.abs(long / np.linalg.norm(skin.vertices[a] - skin.vertices[b], axis=1) - 1).max()
        )

    assert worst("smooth") < worst(NEAREST)


def test_few_handles_are_kept_and_none_is_counted_twice() -> None:
    weights = fewest(np.array([[0.5, 0.3, 0.2, 0.0], [0.0, 0.0, 0.0, 1.0]]), 2)
    np.testing.assert_allclose(weights.weight, [[0.625, 0.375], [1.0, 0.0]])
    assert weights.handle.tolist() == [[0, 1], [3, 0]]


def test_a_skin_comes_back_from_its_file(dressed_motion: Motion, tmp_path) -> None:
    skin = dressed_motion.skin
    assert skin is not None
    with h5py.File(tmp_path / "skin.h5", "w") as file:
        put_rest(file, skin.rest)
        put_skin(file, skin)
    with h5py.File(tmp_path / "skin.h5") as file:
        rest = take_rest(file)
        back = take_skin(file, rest)
    assert (rest.bodies, rest.subject, back.about) == (
        skin.rest.bodies,
        skin.rest.subject,
        skin.about,
    )
    np.testing.assert_array_equal(back.weights.handle, skin.weights.handle)
    np.testing.assert_allclose(back.weights.weight, skin.weights.weight, atol=1e-7)
    np.testing.assert_allclose(back.vertices, skin.vertices, atol=1e-7)


def test_a_motion_without_a_rest_pose_keeps_the_tube(small_motion: Motion) -> None:
    assert dressed(small_motion).skin is None
    assert skin_surface(small_motion) is small_motion.soft["skin"]


def test_depth_is_that_below_a_ball(dressed_motion: Motion) -> None:
    skin = dressed_motion.skin
    assert skin is not None
    centre = np.array([0.0, 0.0, 0.3])
    way = np.random.default_rng(3).normal(size=(200, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    found = depths(centre + np.concatenate([0.2 * way, 0.4 * way]), skin.vertices, skin.faces).depth
    # the ball is of flat triangles, so that it lies a little inside its radius
    np.testing.assert_allclose(found[:200], 0.1, atol=0.02)
    np.testing.assert_allclose(found[200:], -0.1, atol=0.02)


def test_a_push_gives_every_point_its_layer_and_leaves_the_rest(dressed_motion: Motion) -> None:
    skin = dressed_motion.skin
    assert skin is not None
    point = np.array([[0.31, 0.0, 0.3]])
    free = np.ones(len(skin.vertices))
    out = push_out(skin.vertices, skin.faces, point, np.array([0.01]), free, 1.0)
    assert depths(point, out, skin.faces).depth[0] > 0.0095
    moved = np.linalg.norm(out - skin.vertices, axis=1)
    assert moved[np.argmin(skin.vertices[:, 0])] < 0.1 * moved.max()
    held = push_out(skin.vertices, skin.faces, point, np.array([0.01]), 0.0 * free, 1.0)
    np.testing.assert_array_equal(held, skin.vertices)


def test_neighbours_share_an_edge() -> None:
    near = neighbours(np.array([[0, 1, 2], [1, 3, 2]]), 4).toarray()
    assert near.tolist() == [[0, 1, 1, 0], [1, 0, 1, 1], [1, 1, 0, 1], [0, 1, 1, 0]]


def test_weights_are_of_one_shape() -> None:
    weights = Weights(handle=np.zeros((2, 1), dtype=np.int64), weight=np.ones((2, 1)))
    assert weights.handle.shape == weights.weight.shape
