"""Closed meshes: volume, its gradient, the weight of a fluid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from sim.physics.surface import add_pressure, enclosed_volume, push, volume_and_normals
from sim.physics.types import Floats, Ints

NONE = np.zeros(3)
seeds = st.integers(0, 2**32 - 1)


def hull(points: Floats) -> Ints:
    """Outward faces of the convex hull of points around the origin."""
    found = ConvexHull(points)
    faces = found.simplices.astype(np.int64)
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return faces


def sphere(n: int) -> Floats:
    """Points of a unit sphere along a golden spiral."""
    k = np.arange(n) + 0.5
    z, turn = 1.0 - 2.0 * k / n, np.pi * (1.0 + 5.0**0.5) * k
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def bumpy(seed: int) -> tuple[Floats, Ints]:
    """A closed mesh that is neither convex nor symmetric."""
    rng = np.random.default_rng(seed)
    points = sphere(60)
    faces = hull(points)
    return points * rng.uniform(0.6, 1.4, (60, 1)) + rng.uniform(-2.0, 2.0, 3), faces


def forces(x: Floats, faces: Ints, pressure: float, gradient: Floats = NONE) -> Floats:
    out = np.zeros_like(x)
    add_pressure(x, faces, pressure, gradient, out)
    return out


def test_volume_of_a_cube() -> None:
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
    faces = hull(corners - 0.5)
    assert enclosed_volume(corners, faces) == pytest.approx(1.0, rel=1e-14)
    assert enclosed_volume(corners, faces[:, ::-1].copy()) == pytest.approx(-1.0, rel=1e-14)
    assert enclosed_volume(corners * [2.0, 3.0, 0.5], faces) == pytest.approx(3.0, rel=1e-14)


def test_volume_of_a_sphere_of_second_order_in_the_edge() -> None:
    error = []
    for n in (200, 800, 3200):
        points = sphere(n)
        error.append(4.0 * np.pi / 3.0 - enclosed_volume(points, hull(points)))
    # four times the points halve the edge and quarter the error
    assert error[0] / error[1] == pytest.approx(4.0, rel=0.1)
    assert error[1] / error[2] == pytest.approx(4.0, rel=0.1)
    assert 0.0 < error[2] < 0.01


@given(seeds)
@settings(max_examples=30)
def test_shift_and_turn_change_no_volume(seed: int) -> None:
    x, faces = bumpy(seed)
    rng = np.random.default_rng(seed)
    turned = Rotation.random(random_state=seed % 2**32).apply(x) + rng.uniform(-5.0, 5.0, 3)
    assert enclosed_volume(turned, faces) == pytest.approx(enclosed_volume(x, faces), rel=1e-12)


@given(seeds)
@settings(max_examples=30)
def test_uniform_pressure_has_no_net_force_or_moment(seed: int) -> None:
    x, faces = bumpy(seed)
    f = forces(x, faces, 1000.0)
    size = np.abs(f).sum()
    assert np.abs(f.sum(axis=0)).max() < 1e-13 * size
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < 1e-12 * size


@given(seeds)
@settings(max_examples=10)
def test_force_is_pressure_times_volume_gradient(seed: int) -> None:
    x, faces = bumpy(seed)
    f = forces(x, faces, 700.0)
    h = 1e-5
    for vertex in (0, 17, 42):
        for axis in range(3):
            up, down = x.copy(), x.copy()
            up[vertex, axis] += h
            down[vertex, axis] -= h
            slope = (enclosed_volume(up, faces) - enclosed_volume(down, faces)) / (2.0 * h)
            # the volume is linear in one coordinate, so the difference is exact to rounding
            assert f[vertex, axis] == pytest.approx(700.0 * slope, abs=700.0 * 1e-9)


@given(seeds)
@settings(max_examples=30)
def test_a_sloped_pressure_is_the_weight_of_the_fluid(seed: int) -> None:
    x, faces = bumpy(seed)
    gravity = np.random.default_rng(seed).uniform(-10.0, 10.0, 3)
    f = forces(x, faces, 123.0, 1000.0 * gravity)
    weight = 1000.0 * enclosed_volume(x, faces) * gravity
    np.testing.assert_allclose(f.sum(axis=0), weight, rtol=0.0, atol=1e-11 * np.abs(f).sum())


def test_the_weight_acts_at_the_centre_of_the_fluid() -> None:
    x = sphere(300) * [0.5, 1.0, 2.0] + [1.0, -2.0, 3.0]
    faces = hull(sphere(300))
    f = forces(x, faces, 0.0, np.array([0.0, 0.0, -9810.0]))
    moment = np.cross(x - [1.0, -2.0, 3.0], f).sum(axis=0)
    assert np.abs(moment).max() < 2e-3 * np.abs(f).sum()
    assert f[:, 2].sum() == pytest.approx(-9810.0 * enclosed_volume(x, faces), rel=1e-12)


def pushed(x: Floats, faces: Ints, pressure: float, gradient: Floats = NONE) -> Floats:
    out, normal = np.zeros_like(x), np.empty((len(faces), 3))
    volume_and_normals(x, faces, normal)
    push(x, faces, normal, pressure, gradient, out)
    return out


def test_dilorenzo_eq_3_3_pushes_and_never_pulls() -> None:
    x, faces = bumpy(3)
    np.testing.assert_allclose(pushed(x, faces, 900.0), forces(x, faces, 900.0), atol=1e-12)
    assert not pushed(x, faces, -900.0).any()


def test_a_face_under_suction_gets_no_force() -> None:
    x, faces = bumpy(4)
    middle = x[:, 2].mean()
    up = np.array([0.0, 0.0, 500.0])
    f = pushed(x, faces, -500.0 * middle, up)
    # pressure grows with height from nothing at the middle: what lies below is left alone
    below = np.setdiff1d(np.arange(len(x)), faces[x[faces, 2].mean(axis=1) > middle])
    assert len(below) and not f[below].any()
    # and the mesh is pushed as a whole, which a pressure that may pull never does here
    assert f[:, 2].sum() > 0.0
