"""Volumes add up: at the built pose, in any pose, and in a run."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.breaths import sawtooth
from sim.physics.surface import add_pressure, enclosed_volume
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.simulate import BREATH_STEP, Trajectory, group_activation, replay, simulate

NONE = np.zeros(3)
CALM = np.array([0.1, 0.06, 0.0, 0.0])
DEEP = np.array([0.4, 0.3, 0.2, 0.2])


def breath(resting: RestingTorso, levels: Floats, *, posture: str = "upright") -> Trajectory:
    time = np.arange(round(4.0 / BREATH_STEP)) * BREATH_STEP
    inward, outward = sawtooth(time, inspiration=1.7, expiration=2.3, pause=0.4)
    shape = np.stack([inward, inward, outward, outward], axis=1)
    return simulate(resting, group_activation(shape * levels), posture=posture, rate=50.0)


@pytest.fixture(scope="module")
def calm(resting: RestingTorso) -> Trajectory:
    return breath(resting, CALM)


@pytest.fixture(scope="module")
def deep(resting: RestingTorso) -> Trajectory:
    return breath(resting, DEEP)


def places(resting: RestingTorso, trajectory: Trajectory) -> Floats:
    everything = np.arange(len(resting.upright.points))
    return replay(resting, trajectory, everything).points


@pytest.mark.parametrize("seed", range(5))
def test_what_the_dome_displaces_both_cavities_see(resting: RestingTorso, seed: int) -> None:
    plant, torso = resting.torso.plant, resting.torso
    x = resting.upright.points
    dome = np.unique(torso.diaphragm[:, 1:])
    moved = x.copy()
    rng = np.random.default_rng(seed)
    moved[dome] += 0.01 * rng.standard_normal((len(dome), 3)) + [0.0, 0.0, -0.02]
    change = [
        enclosed_volume(moved, faces) - enclosed_volume(x, faces)
        for faces in (plant.chest_faces, plant.abdomen_faces)
    ]
    assert abs(change[0]) > 1e-4
    assert abs(sum(change)) < 1e-9


@pytest.mark.parametrize("cavity", ["chest_faces", "abdomen_faces"])
def test_uniform_pressure_has_no_net_force_or_moment(resting: RestingTorso, cavity: str) -> None:
    x, faces = resting.upright.points, getattr(resting.torso.plant, cavity)
    f = np.zeros_like(x)
    add_pressure(x, faces, 1000.0, NONE, f)
    size = np.abs(f).sum()
    assert size > 10.0
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < 1e-12 * size


@pytest.mark.parametrize("cavity", ["chest_faces", "abdomen_faces"])
def test_force_is_the_volume_gradient(resting: RestingTorso, cavity: str) -> None:
    x, faces = resting.upright.points, getattr(resting.torso.plant, cavity)
    f = np.zeros_like(x)
    add_pressure(x, faces, 1.0, NONE, f)
    rng = np.random.default_rng(0)
    move = rng.standard_normal(x.shape)
    h = 1e-5
    up, down = enclosed_volume(x + h * move, faces), enclosed_volume(x - h * move, faces)
    assert (f * move).sum() == pytest.approx((up - down) / (2.0 * h), rel=1e-6)


@pytest.mark.parametrize("cavity", ["chest_faces", "abdomen_faces"])
def test_turning_or_shifting_the_torso_changes_no_volume(
    resting: RestingTorso, cavity: str
) -> None:
    x, faces = resting.upright.points, getattr(resting.torso.plant, cavity)
    before = enclosed_volume(x, faces)
    for seed in range(5):
        turn = Rotation.random(random_state=seed)
        shift = np.random.default_rng(seed).uniform(-3.0, 3.0, 3)
        assert abs(enclosed_volume(turn.apply(x) + shift, faces) - before) < 1e-14


def test_recorded_volumes_are_those_of_the_points(resting: RestingTorso, calm: Trajectory) -> None:
    plant = resting.torso.plant
    found = np.array([enclosed_volume(x, plant.chest_faces) for x in places(resting, calm)])
    # a frame keeps the place after its step, the volume at the place predicted before it
    np.testing.assert_allclose(found, calm.chest, rtol=0.0, atol=1e-6)
    change = calm.lung - calm.chest
    assert np.ptp(change) < 1e-12
    assert -change[0] == pytest.approx(plant.constants.tissue_volume)


def swept(x: Floats, faces: np.ndarray) -> Floats:
    """Volume that faces sweep outwards from frame to frame, summed, m^3; (n_frames,)."""
    middle, move = 0.5 * (x[1:] + x[:-1]), np.diff(x, axis=0)
    a, b, c = (middle[:, faces[:, k]] for k in range(3))
    area = 0.5 * np.cross(b - a, c - a)
    rate = (area * move[:, faces].mean(axis=2)).sum(axis=(1, 2))
    return np.concatenate([[0.0], np.cumsum(rate)])


def test_chest_takes_what_its_walls_sweep(resting: RestingTorso, deep: Trajectory) -> None:
    plant = resting.torso.plant
    x = places(resting, deep)
    outward = np.array([enclosed_volume(p, plant.chest_faces) for p in x])
    change = outward - outward[0]
    assert np.ptp(change) > 5e-4
    np.testing.assert_allclose(
        swept(x, plant.chest_faces), change, rtol=0.0, atol=1e-3 * np.ptp(change)
    )


def test_rib_cage_and_belly_wall_share_the_breath(resting: RestingTorso, deep: Trajectory) -> None:
    # rib cage (apposed part included) and belly wall together are the change of the chest
    plant = resting.torso.plant
    x = places(resting, deep)
    whole = swept(x, plant.chest_faces)
    outer = swept(x, resting.torso.outer)
    assert np.abs(outer - whole).max() < 0.03 * np.ptp(whole)


def test_belly_keeps_its_volume(calm: Trajectory, deep: Trajectory) -> None:
    for run in (calm, deep):
        assert np.ptp(run.abdomen) < 0.02 * run.abdomen[0]


def test_gas_in_the_lung_is_what_flowed_in(resting: RestingTorso, deep: Trajectory) -> None:
    atmosphere = resting.torso.plant.constants.atmosphere
    gas = (atmosphere + deep.alveolar) * deep.lung / atmosphere
    dt = deep.time[1] - deep.time[0]
    flowed = -np.cumsum(0.5 * (deep.flow[1:] + deep.flow[:-1])) * dt
    # flow is recorded ten steps apart, hence one part in a hundred
    np.testing.assert_allclose(gas[1:] - gas[0], flowed, rtol=0.0, atol=0.01 * np.ptp(flowed))
