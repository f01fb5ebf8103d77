"""Points, projections and joints of the rigid bodies."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sim import engine
from sim.physics.joints import add_joints, rotation_vector
from sim.physics.mass import add_mass, arm, project_masses
from sim.physics.plant import Joints
from sim.physics.rigid import project
from sim.physics.types import Floats
from sim.rest import Machine, RestState
from sim.resting import RestingTorso

seeds = st.integers(0, 2**32 - 1)
STRAIGHT = np.zeros((0, 3))


def scipy_to_mujoco(rotation: Rotation) -> Floats:
    return np.roll(rotation.as_quat(), 1)


def one_ball(seed: int, *, limited: bool = False) -> Joints:
    """One elastic ball joint with a random stiffness and slack angle."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, 3))
    none = np.zeros(0, dtype=np.int64)
    return Joints(
        ball_dof=np.zeros(1, dtype=np.int64),
        ball_qpos=np.zeros(1, dtype=np.int64),
        ball_stiffness=(root @ root.T + np.eye(3))[None],
        ball_damping=np.zeros((1, 3, 3)),
        ball_rest=rng.uniform(-0.2, 0.2, (1, 3)),
        ball_limit=rng.uniform(0.02, 0.1, (1, 6)) if limited else np.full((1, 6), np.pi),
        limit_stiffness=np.array([40.0 if limited else 0.0]),
        hinge_dof=none, hinge_qpos=none,
        hinge_stiffness=np.zeros(0), hinge_damping=np.zeros(0), hinge_rest=np.zeros(0),
    )  # fmt: skip


def energy(joints: Joints, rotation: Rotation) -> float:
    r = rotation.as_rotvec()
    off = r - joints.ball_rest[0]
    top, bottom = joints.ball_limit[0, :3], joints.ball_limit[0, 3:]
    past = np.maximum(r - top, 0.0) + np.minimum(r + bottom, 0.0)
    return float(
        0.5 * off @ joints.ball_stiffness[0] @ off + 0.5 * joints.limit_stiffness[0] * past @ past
    )


def torque(
    joints: Joints, rotation: Rotation, rate: Floats | None = None, bend: Floats = STRAIGHT
) -> Floats:
    tau = np.zeros(3)
    speed = np.zeros(3) if rate is None else rate
    add_joints(joints, bend, scipy_to_mujoco(rotation), speed, tau)
    return tau


def gradient(joints: Joints, rotation: Rotation) -> Floats:
    """Fall of the energy with a turn about each axis of the child."""
    h, out = 1e-6, np.empty(3)
    for c in range(3):
        turn = np.zeros(3)
        turn[c] = h
        up, down = (rotation * Rotation.from_rotvec(s * turn) for s in (1.0, -1.0))
        out[c] = -(energy(joints, up) - energy(joints, down)) / (2.0 * h)
    return out


@given(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3))
def test_rotation_vector_of_a_quaternion(vector: list[float]) -> None:
    rotation = Rotation.from_rotvec(vector)
    out = np.empty(3)
    for sign in (1.0, -1.0):
        rotation_vector(sign * scipy_to_mujoco(rotation), out)
        assert np.linalg.norm(out) <= np.pi + 1e-9
        assert (Rotation.from_rotvec(out) * rotation.inv()).magnitude() < 1e-7


@given(seeds, st.floats(1e-3, 1.2))
def test_joint_torque_is_the_gradient_of_its_energy(seed: int, angle: float) -> None:
    # the series of the rotation vector's rate is cut after angle^2 / 12; the next term is
    # angle^4 / 720 of the elastic torque
    joints = one_ball(seed)
    axis = np.random.default_rng(seed + 1).standard_normal(3)
    rotation = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
    found, expected = torque(joints, rotation), gradient(joints, rotation)
    largest = np.linalg.norm(joints.ball_stiffness[0], 2) * (angle + 0.35)
    assert np.linalg.norm(found - expected) <= largest * (angle**4 / 500.0 + 1e-8)


@given(seeds)
def test_a_bend_moves_the_slack_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    joints, bend = one_ball(seed), rng.uniform(-0.3, 0.3, (1, 3))
    moved = joints._replace(ball_rest=joints.ball_rest + bend)
    rotation = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3))
    np.testing.assert_allclose(
        torque(joints, rotation, bend=bend), torque(moved, rotation), rtol=1e-12, atol=1e-12
    )


@given(seeds)
def test_limits_push_back_along_the_gradient_too(seed: int) -> None:
    joints = one_ball(seed, limited=True)
    axis = np.random.default_rng(seed + 1).standard_normal(3)
    rotation = Rotation.from_rotvec(0.25 * axis / np.linalg.norm(axis))
    largest = (np.linalg.norm(joints.ball_stiffness[0], 2) + 40.0) * 0.6
    error = torque(joints, rotation) - gradient(joints, rotation)
    assert np.linalg.norm(error) <= largest * (0.25**4 / 500.0 + 1e-8)


@given(seeds)
def test_joint_friction_takes_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, 3))
    joints = one_ball(seed)._replace(ball_damping=(root @ root.T)[None])
    rotation, rate = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3)), rng.standard_normal(3)
    friction = torque(joints, rotation, rate) - torque(joints, rotation)
    np.testing.assert_allclose(friction, -root @ root.T @ rate, rtol=1e-9, atol=1e-9)
    assert friction @ rate <= 1e-12


def test_hinge_pulls_back_to_its_slack_angle() -> None:
    joints = one_ball(0)._replace(
        ball_dof=np.zeros(0, dtype=np.int64),
        hinge_dof=np.array([0]), hinge_qpos=np.array([0]), hinge_stiffness=np.array([3.0]),
        hinge_damping=np.array([0.5]), hinge_rest=np.array([0.1]),
    )  # fmt: skip
    tau = np.zeros(1)
    add_joints(joints, STRAIGHT, np.array([0.3]), np.array([2.0]), tau)
    assert tau[0] == pytest.approx(-3.0 * 0.2 - 0.5 * 2.0)


class Pose:
    """The torso's bones in a random pose near rest."""

    def __init__(self, rest: RestState, seed: int) -> None:
        self.rest, self.machine = rest, Machine(rest.torso)
        self.rng = np.random.default_rng(seed)
        self.qpos = rest.state.qpos.copy()
        away = 0.1 * self.rng.standard_normal(self.machine.model.nv)
        mujoco.mj_integratePos(self.machine.model, self.qpos, away, 1.0)

    def points(self, velocity: Floats, time: float) -> Floats:
        """Bound points where a constant velocity leads."""
        torso = self.rest.torso
        state = self.rest.state._replace(qpos=self.qpos, qvel=velocity)
        engine.predict(self.machine.bones, torso.plant, self.machine.work, state, time)
        return self.machine.work.x[: torso.n_bound].copy()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_projection_is_virtual_work(resting: RestingTorso, seed: int) -> None:
    pose = Pose(resting.upright, seed)
    torso, work = resting.torso, pose.machine.work
    nv, h = pose.machine.model.nv, 1e-6
    force = np.zeros_like(work.f)
    force[: torso.n_bound] = pose.rng.standard_normal((torso.n_bound, 3))
    tau = np.zeros(nv)
    pose.points(np.zeros(nv), 0.0)
    bones = pose.machine.bones
    project(
        work.riders, torso.plant.tree, work.x, force, bones.centre, bones.motion, work.wrench, tau
    )
    for _ in range(5):
        velocity = pose.rng.standard_normal(nv)
        move = (pose.points(velocity, h) - pose.points(velocity, -h)) / (2.0 * h)
        power = float((force[: torso.n_bound] * move).sum())
        assert tau @ velocity == pytest.approx(power, rel=1e-6, abs=1e-5)


def test_velocities_are_those_of_the_points(resting: RestingTorso) -> None:
    pose = Pose(resting.upright, 4)
    nv, h = pose.machine.model.nv, 1e-6
    velocity = pose.rng.standard_normal(nv)
    move = (pose.points(velocity, h) - pose.points(velocity, -h)) / (2.0 * h)
    pose.points(velocity, 0.0)
    found = pose.machine.work.v[: resting.torso.n_bound]
    np.testing.assert_allclose(found, move, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_masses_between_points_are_what_the_projection_makes_of_them(
    resting: RestingTorso, seed: int
) -> None:
    pose = Pose(resting.upright, seed)
    torso, work, bones = resting.torso, pose.machine.work, pose.machine.bones
    nv, tree = pose.machine.model.nv, torso.plant.tree
    pose.points(np.zeros(nv), 0.0)

    def row(force: Floats) -> Floats:
        tau = np.zeros(nv)
        project(work.riders, tree, work.x, force, bones.centre, bones.motion, work.wrench, tau)
        return tau

    n_bodies = len(tree.body_root)
    pairs, joined = np.zeros((n_bodies, n_bodies, 6, 6)), np.zeros((n_bodies, n_bodies))
    expected, found = np.zeros((nv, nv)), np.ones((nv, nv))
    for p, q in pose.rng.integers(0, torso.n_bound, (20, 2)).tolist():
        # a thread from p to q; p rides on the later body
        a, b = torso.plant.point_body[[p, q]]
        if a < b:
            p, q, a, b = q, p, b, a
        root = pose.rng.standard_normal((3, 3))
        mass = root @ root.T
        m = tuple(mass[np.triu_indices(3)])
        r, s = (
            arm(work.x, i, bones.centre, tree.body_root[torso.plant.point_body[i]]) for i in (p, q)
        )
        for k, x, y, i, j in ((1.0, r, r, a, a), (1.0, s, s, b, b), (-1.0, r, s, a, b)):
            add_mass(m, k, x, y, pairs, i, j)
            joined[i, j] = 1.0
        if a == b:
            add_mass(m, -1.0, s, r, pairs, a, a)
        for direction in np.linalg.cholesky(mass).T:
            force = np.zeros_like(work.f)
            force[p] += direction
            force[q] -= direction
            expected += np.outer(row(force), row(force))
    wrench = np.empty((n_bodies, 6, nv))
    project_masses(tree, bones.motion, pairs, joined, wrench, found)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())
    assert not pairs.any()
    assert not joined.any()
