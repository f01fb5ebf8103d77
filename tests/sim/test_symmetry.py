"""Left and right of the built torso: the same points, bones, muscles and tissue."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import Subject, Torso, build_torso
from sim.physics.types import Floats, Ints


@pytest.fixture(scope="module")
def torso() -> Torso:
    return build_torso(Subject(sex="male", stature=1.756, mass=75.0))


def mirrored(points: Floats) -> Floats:
    return points * [1.0, -1.0, 1.0]


def unlike(torso: Torso, a: Ints, b: Ints, *values: Floats) -> float:
    """How far the threads are from having a mirror image at their place, of the same values.

    Parameters
    ----------
    a, b : (n,), points that they run between
    values : (n,) each; taken over the largest, so that they count as metres do
    """
    middle = 0.5 * (torso.places[a] + torso.places[b])
    scaled = [value / np.abs(value).max() for value in values]
    has, wants = (np.column_stack([at, *scaled]) for at in (middle, mirrored(middle)))
    return float(cKDTree(has).query(wants)[0].max())


def test_left_is_the_mirror_of_right(torso: Torso) -> None:
    x = torso.places
    distance, _ = cKDTree(x).query(mirrored(x))
    assert distance.max() < 1e-9
    model = torso.skeleton.model
    for i in range(1, 13):
        left, right = model.body(f"rib_L{i}"), model.body(f"rib_R{i}")
        assert left.mass[0] == pytest.approx(right.mass[0])
        np.testing.assert_allclose(left.inertia, right.inertia, rtol=1e-9)


@pytest.mark.parametrize("group", MUSCLE_GROUPS)
def test_muscles_are_as_strong_and_as_long(torso: Torso, group: str) -> None:
    m = torso.plant.muscles
    e = np.flatnonzero(m.group == MUSCLE_GROUPS.index(group))
    assert unlike(torso, m.a[e], m.b[e], m.f_max[e], m.rest[e]) < 1e-9


def test_tissue_is_as_stiff_and_as_long(torso: Torso) -> None:
    """A thread between two columns took its strip from one of them alone: 522 of 1,350 differed."""
    t = torso.plant.tissue
    assert unlike(torso, t.a, t.b, t.stiffness, t.rest, t.damping, 1.0 + t.curve) < 1e-9
