"""The chest cavity bound to four neighbours: it is the cavity at rest, and follows as printed."""

from __future__ import annotations

import numpy as np
import pytest

from sim.model.binding import NEIGHBOURS, BoundCavity, bind_cavity
from sim.motion import rest_motion
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats
from sim.resting import RestingTorso

Pose = tuple[Floats, Floats, Floats]


@pytest.fixture(scope="module")
def pose(resting: RestingTorso) -> Pose:
    """Places of the built bodies, (n_bodies, 3), their rotations and all points at rest."""
    torso, points = resting.torso, resting.upright.points
    body, local = torso.plant.point_body, torso.plant.point_local
    position = np.zeros((torso.skeleton.model.nbody, 3))
    position[body] = points[: torso.n_bound] - local
    return position, np.broadcast_to(np.eye(3), (len(position), 3, 3)).copy(), points


@pytest.fixture(scope="module")
def cavity(resting: RestingTorso, pose: Pose) -> BoundCavity:
    return bind_cavity(resting.torso, *pose)


def where(cavity: BoundCavity, pose: Pose) -> Floats:
    return cavity.places(*(part[None] for part in pose))[0]


def test_at_rest_it_is_the_cavity_itself(
    resting: RestingTorso, cavity: BoundCavity, pose: Pose
) -> None:
    faces = resting.torso.plant.chest_faces
    np.testing.assert_allclose(where(cavity, pose), pose[2][np.unique(faces)], atol=1e-12)
    volume = enclosed_volume(where(cavity, pose), cavity.faces)
    assert volume == pytest.approx(enclosed_volume(pose[2], faces), rel=1e-12)


def test_dilorenzo_section_6_3_1_four_equal_weights(cavity: BoundCavity) -> None:
    weight = np.hstack([cavity.bone, cavity.share])
    assert ((weight > 0.0).sum(axis=1) == NEIGHBOURS).all()
    assert set(np.unique(weight)) == {0.0, 0.25}


def test_a_vertex_shifts_its_points_by_a_quarter(cavity: BoundCavity, pose: Pose) -> None:
    position, rotation, points = pose
    moved, k = points.copy(), int(np.argmax(cavity.share.sum(axis=0)))
    moved[cavity.vertex[k]] += [0.0, 0.0, 0.04]
    way = where(cavity, (position, rotation, moved)) - where(cavity, pose)
    expected = cavity.share[:, [k]] * np.array([0.0, 0.0, 0.04])
    np.testing.assert_allclose(way, expected, atol=1e-12)


def test_a_bone_carries_its_points_as_it_turns(cavity: BoundCavity, pose: Pose) -> None:
    position, rotation, points = pose
    b, c, s = int(np.argmax(cavity.bone.sum(axis=0))), np.cos(0.3), np.sin(0.3)
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    turned = rotation.copy()
    turned[b] = turn
    start = where(cavity, pose)
    way = where(cavity, (position, turned, points)) - start
    whole = (start - position[b]) @ turn.T - (start - position[b])
    np.testing.assert_allclose(way, cavity.bone[:, [b]] * whole, atol=1e-12)


def test_the_calibrated_torso_binds_nothing(resting: RestingTorso) -> None:
    assert resting.cavity is None
    still = rest_motion(resting, "upright")
    assert still.volumes["lung"] + still.tissue_volume == still.volumes["chest_cavity"]
