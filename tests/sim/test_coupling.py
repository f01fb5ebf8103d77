"""The step's matrix as a whole: what its sparse solution solves, and that it is a mass."""

from __future__ import annotations

import numpy as np
import pytest

from sim import engine
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.coupling import pull_bodies, push_particles
from sim.physics.system import solve_step
from sim.physics.types import Floats
from sim.rest import Machine, copy_state
from sim.resting import RestingTorso
from sim.simulate import GRAVITY

STEP = 0.004


@pytest.fixture(scope="module")
def refreshed(resting: RestingTorso) -> Machine:
    """A machine whose matrix was built at rest, half of every muscle active."""
    torso, machine = resting.torso, Machine(resting.torso)
    bones, work, plant = machine.bones, machine.work, torso.plant
    machine.set_gravity(GRAVITY["upright"])
    state = copy_state(resting.upright.state)
    activation = np.full(len(MUSCLE_GROUPS), 0.5)
    drive = engine.make_drive(
        activation[None], gravity=GRAVITY["upright"], locked=np.zeros(len(state.qvel))
    )
    one = engine.Schedule(step=STEP, refresh_every=1, record_every=2, drag=0.0, speed_limit=100.0)
    record = engine.make_record(0, n_q=len(state.qpos), n_particles=torso.n_particles)
    assert engine.run(bones, plant, work, state, one, drive, record) == 1
    return machine


def blocks(resting: RestingTorso, machine: Machine) -> tuple[Floats, Floats, Floats]:
    """Both diagonal blocks and the coupling, (n_particles * 3, n_dof), as full matrices."""
    matrix, pattern = machine.work.matrix, resting.torso.plant.pattern
    n, n_dof = len(matrix.diagonal), len(matrix.rigid)
    soft = np.zeros((n, 3, n, 3))
    soft[np.arange(n), :, np.arange(n), :] = matrix.diagonal
    first, second = pattern.order[pattern.pair].T
    soft[first, :, second, :] = matrix.off
    soft[second, :, first, :] = matrix.off.transpose(0, 2, 1)
    coupling = np.zeros((3 * n, n_dof))
    for k in range(n_dof):
        pushed = np.zeros((n, 3))
        push_particles(resting.torso.plant.tree, matrix.coupling, np.eye(n_dof)[k], pushed)
        coupling[:, k] = -pushed.ravel()
    return matrix.rigid, soft.reshape(3 * n, 3 * n), coupling


def test_the_true_matrix_is_a_mass(resting: RestingTorso, refreshed: Machine) -> None:
    rigid, soft, coupling = blocks(resting, refreshed)
    whole = np.block([[rigid, coupling.T], [coupling, soft]])
    np.testing.assert_allclose(whole, whole.T, atol=1e-9 * np.abs(whole).max())
    # threads only add to what the masses have: no motion is easier with than without them
    assert np.linalg.eigvalsh(whole).min() > 0.0
    # a particle is dragged along by its body, never pushed the other way
    assert (coupling.T @ coupling).trace() > 0.0
    assert np.linalg.eigvalsh(np.block([[rigid, -coupling.T], [-coupling, soft]])).min() > 0.0


def test_bodies_feel_what_particles_feel(resting: RestingTorso, refreshed: Machine) -> None:
    _, soft, coupling = blocks(resting, refreshed)
    matrix, rng = refreshed.work.matrix, np.random.default_rng(1)
    change = rng.standard_normal(len(soft))
    pull_bodies(resting.torso.plant.tree, matrix.coupling, change.reshape(-1, 3))
    np.testing.assert_allclose(matrix.coupling.back, -coupling.T @ change, atol=1e-9)


def test_solution_is_one_sweep_of_block_gauss_seidel(
    resting: RestingTorso, refreshed: Machine
) -> None:
    rigid, soft, coupling = blocks(resting, refreshed)
    matrix, plant = refreshed.work.matrix, resting.torso.plant
    more = coupling @ np.linalg.solve(rigid, coupling.T)
    solved = np.block([[rigid, coupling.T], [coupling, soft + more]])
    # what it holds too much is small beside what it holds
    assert np.trace(more) < 0.2 * np.trace(soft)
    impulse = np.random.default_rng(2).standard_normal(len(solved))
    for belly, chest in ((0.0, 0.0), (2e4, 1e3)):
        change = impulse.copy()
        solve_step(plant.tree, plant.pattern, matrix, change, belly, chest)
        volumes = belly * np.outer(matrix.belly, matrix.belly)
        volumes += chest * np.outer(matrix.chest, matrix.chest)
        direct = np.linalg.solve(solved + volumes, impulse)
        np.testing.assert_allclose(change, direct, atol=1e-7 * np.abs(direct).max())
