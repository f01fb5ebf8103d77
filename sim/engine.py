"""The compiled step loop: MuJoCo for the bones, our kernels for everything soft.

MuJoCo gives kinematics, inertia and the bias of gravity and spin at the predicted pose; the
implicit step of `sim.physics.system` advances bones, particles and pressures together. The
loop holds no lock of the interpreter, so runs go side by side in threads, bit for bit alike.
"""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import NamedTuple

import llvmlite.binding as llvm
import mujoco
import numpy as np
from numba import types

from sim.physics import lung
from sim.physics.compiled import compiled
from sim.physics.forces import add_contacts, add_links, add_muscles, add_tissue, follow_sheet
from sim.physics.plant import Plant
from sim.physics.rigid import add_joints, move_points, place_points, project
from sim.physics.surface import add_pressure, enclosed_volume
from sim.physics.system import Work, refresh, solve_step
from sim.physics.types import Floats, Ints

_CALLS = ("mj_kinematics", "mj_comPos", "mj_comVel", "mj_makeM", "mj_rne", "mj_integratePos")


def _register() -> None:
    """Make MuJoCo's functions known by name, so that compiled code can be cached on disk."""
    folder = Path(mujoco.__file__).parent
    library = ctypes.CDLL(str(next(folder.glob("libmujoco.so*"))))
    for name in _CALLS:
        address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        llvm.add_symbol(name, address)


_register()
_POINTER = types.uintp
_PAIR = types.void(_POINTER, _POINTER)
mj_kinematics = types.ExternalFunction("mj_kinematics", _PAIR)
mj_comPos = types.ExternalFunction("mj_comPos", _PAIR)
mj_comVel = types.ExternalFunction("mj_comVel", _PAIR)
mj_makeM = types.ExternalFunction("mj_makeM", _PAIR)
mj_rne = types.ExternalFunction("mj_rne", types.void(_POINTER, _POINTER, types.int32, _POINTER))
mj_integratePos = types.ExternalFunction(
    "mj_integratePos", types.void(_POINTER, _POINTER, _POINTER, types.float64)
)


BRISK, BRISK_EVERY = 0.25, 3
"""Speed, m/s, above which threads turn so fast that the matrix is renewed every few steps."""
FOLLOW_EVERY = 2
"""Steps after which the diaphragm particles look for the face beside them."""


class Bones(NamedTuple):
    """MuJoCo's model and data by address, and views of the arrays that the loop reads."""

    model: int
    data: int
    qpos: Floats
    qvel: Floats
    position: Floats
    rotation: Floats
    centre: Floats
    motion: Floats
    spatial: Floats
    mass: Floats


def view_bones(model: mujoco.MjModel, data: mujoco.MjData) -> Bones:
    """Views into `data`, which must outlive them."""
    return Bones(
        model=model._address,
        data=data._address,
        qpos=data.qpos,
        qvel=data.qvel,
        position=data.xpos,
        rotation=data.xmat.reshape(-1, 9),
        centre=data.subtree_com,
        motion=data.cdof,
        spatial=data.cvel,
        mass=data.M,
    )


class State(NamedTuple):
    """What changes during a run."""

    qpos: Floats
    qvel: Floats
    soft: Floats
    soft_velocity: Floats
    """(n_particles, 3), m and m/s"""
    gas: Floats
    """(1,), pressure times volume of the gas in the lung, Pa m^3"""


class Schedule(NamedTuple):
    """How to run."""

    step: float
    refresh_every: int
    record_every: int
    drag: float
    """1/s, damping of every velocity, for settling only"""
    speed_limit: float
    """m/s, beyond which the run has diverged"""


class Drive(NamedTuple):
    """What drives a run, step by step."""

    activation: Floats
    """(n_steps, n_groups)"""
    gravity: Floats
    """(3,), m/s^2"""
    locked: Floats
    """(n_dof,), kg or kg m^2 added to hold a degree of freedom"""
    pleural: float
    """Pa; if not NaN the pleural pressure is held at it and the lung left out"""


class Record(NamedTuple):
    """What a run leaves behind, a row a recorded frame."""

    qpos: Floats
    soft: Floats
    scalars: Floats
    """(n_frames, 9): lung, chest, abdomen volume; alveolar, pleural, abdominal pressure;
    flow out; least contact gap; largest speed"""
    tension: Floats
    """(n_frames, n_elements) or empty"""


@compiled
def predict(bones: Bones, plant: Plant, work: Work, state: State, step: float) -> None:
    """Kinematics and velocities at the place that the present velocities lead to."""
    bones.qpos[:] = state.qpos
    bones.qvel[:] = state.qvel
    mj_integratePos(bones.model, bones.qpos.ctypes.data, bones.qvel.ctypes.data, step)
    mj_kinematics(bones.model, bones.data)
    mj_comPos(bones.model, bones.data)
    mj_comVel(bones.model, bones.data)
    bound = plant.point_body.shape[0]
    place_points(plant, bones.position, bones.rotation, work.x)
    move_points(plant, work.x, bones.spatial, bones.centre, work.v)
    for p in range(state.soft.shape[0]):
        for c in range(3):
            work.x[bound + p, c] = state.soft[p, c] + step * state.soft_velocity[p, c]
            work.v[bound + p, c] = state.soft_velocity[p, c]


@compiled
def add_elastic(bones: Bones, plant: Plant, work: Work, activation: Floats) -> None:
    """Forces of muscles, tissue, links and contact at the predicted place."""
    add_muscles(
        work.x, work.v, plant.muscles, plant.constants, activation,
        work.length, work.rate, work.factor, work.tension, work.f,
    )  # fmt: skip
    add_tissue(work.x, work.v, plant.tissue, work.pull, work.f)
    add_links(work.x, work.v, plant.links, plant.point_body, bones.rotation, work.f)
    add_contacts(work.x, work.v, plant.contacts, plant.constants, work.held, work.gap, work.f)


@compiled
def lung_pressures(
    plant: Plant, gas: float, chest: float, step: float, out: Floats
) -> tuple[float, float]:
    """Pressures and flow at the end of a step with a given chest volume.

    Parameters
    ----------
    chest : volume of the chest cavity, m^3
    out : (4,), lung volume, alveolar and pleural pressure, flow out; written

    Returns
    -------
    gas left and the fall of pleural pressure with volume, Pa/m^3
    """
    k = plant.constants
    volume = chest - k.tissue_volume
    cap = lung.flow_cap(volume, k.residual_volume, k.total_capacity, k.peak_flow)
    flow = lung.outflow(gas, volume, step, k.atmosphere, k.airway_k1, k.airway_k2, cap)
    left = gas - step * k.atmosphere * flow
    alveolar = left / volume - k.atmosphere
    recoil = lung.recoil_pressure(volume, k.lung_limit, k.lung_scale, k.lung_rate)
    stiffness = lung.recoil_stiffness(volume, k.lung_limit, k.lung_scale, k.lung_rate)
    stiffness += lung.alveolar_stiffness(
        gas, volume, flow, step, k.atmosphere, k.airway_k1, k.airway_k2
    )
    out[0], out[1], out[2], out[3] = volume, alveolar, alveolar - recoil, flow
    return left, stiffness


@compiled
def add_cavities(
    plant: Plant, work: Work, drive: Drive, gas: float, step: float, out: Floats
) -> tuple[float, float, float]:
    """Forces of the two cavities.

    Parameters
    ----------
    out : (7,), volumes of lung, chest, abdomen; alveolar, pleural, abdominal pressure; flow

    Returns
    -------
    gas left; stiffness of the abdomen and of the chest, Pa/m^3
    """
    k = plant.constants
    chest = enclosed_volume(work.x, plant.chest_faces)
    belly = enclosed_volume(work.x, plant.abdomen_faces)
    lungs = np.empty(4)
    left, chest_stiffness = lung_pressures(plant, gas, chest, step, lungs)
    if not np.isnan(drive.pleural):
        left, chest_stiffness, lungs[2] = gas, 0.0, drive.pleural
    pressure = k.bulk_modulus * (k.abdomen_volume / belly - 1.0)
    weight = k.content_density * drive.gravity
    zero = np.zeros(3)
    add_pressure(work.x, plant.chest_faces, lungs[2], zero, work.f)
    origin = pressure - np.dot(weight, plant.reference)
    add_pressure(work.x, plant.abdomen_faces, origin, weight, work.f)
    out[0], out[1], out[2] = lungs[0], chest, belly
    out[3], out[4], out[5], out[6] = lungs[1], lungs[2], pressure, lungs[3]
    return left, k.bulk_modulus * k.abdomen_volume / belly**2, chest_stiffness


@compiled
def total_forces(
    bones: Bones,
    plant: Plant,
    work: Work,
    state: State,
    drive: Drive,
    activation: Floats,
    step: float,
    out: Floats,
) -> tuple[float, float, float]:
    """All forces at the predicted place: `work.tau` on the bones, `work.f` on the particles."""
    bound = plant.point_body.shape[0]
    work.f[:] = 0.0
    add_elastic(bones, plant, work, activation)
    result = add_cavities(plant, work, drive, state.gas[0], step, out)
    project(plant, work.x, work.f, bones.centre, bones.motion, work.wrench, work.tau)
    add_joints(plant.joints, bones.qpos, bones.qvel, work.tau)
    mj_rne(bones.model, bones.data, 0, work.bias.ctypes.data)
    for i in range(work.tau.shape[0]):
        work.tau[i] -= work.bias[i]
    for p in range(state.soft.shape[0]):
        for c in range(3):
            work.f[bound + p, c] += plant.particle_weight[p] * drive.gravity[c]
    return result


@compiled
def _apply(bones: Bones, work: Work, state: State, schedule: Schedule) -> float:
    """Advance the state by the solved change of velocity; returns the largest speed."""
    n_dof = state.qvel.shape[0]
    keep = np.exp(-schedule.drag * schedule.step)
    fastest = 0.0
    for i in range(n_dof):
        state.qvel[i] = keep * (state.qvel[i] + work.change[i])
    mj_integratePos(bones.model, state.qpos.ctypes.data, state.qvel.ctypes.data, schedule.step)
    for p in range(state.soft.shape[0]):
        for c in range(3):
            speed = keep * (state.soft_velocity[p, c] + work.change[n_dof + 3 * p + c])
            state.soft_velocity[p, c] = speed
            state.soft[p, c] += schedule.step * speed
            fastest = max(fastest, abs(speed))
    for p in range(0, work.v.shape[0] - state.soft.shape[0], 7):
        for c in range(3):
            fastest = max(fastest, abs(work.v[p, c]))
    return fastest if np.isfinite(state.qvel.sum() + state.soft_velocity.sum()) else np.inf


@compiled
def run(
    bones: Bones,
    plant: Plant,
    work: Work,
    state: State,
    schedule: Schedule,
    drive: Drive,
    record: Record,
) -> int:
    """Advance `state` through all steps of `drive`.

    Returns
    -------
    number of steps done; fewer than asked means that the run diverged at that step
    """
    n_dof, bound = state.qvel.shape[0], plant.point_body.shape[0]
    step = schedule.step
    out = np.empty(7)
    frame, fastest, refreshed = 0, 0.0, -schedule.refresh_every
    for i in range(drive.activation.shape[0]):
        activation = drive.activation[i]
        predict(bones, plant, work, state, step)
        if i % FOLLOW_EVERY == 0:
            follow_sheet(work.x, plant.contacts, work.held)
        due = i - refreshed >= schedule.refresh_every
        if due or (fastest > BRISK and i - refreshed >= BRISK_EVERY):
            refreshed = i
            work.f[:] = 0.0
            add_elastic(bones, plant, work, activation)
            mj_makeM(bones.model, bones.data)
            refresh(
                plant, work, step, activation, bones.mass, drive.locked,
                bones.centre, bones.motion,
            )  # fmt: skip
        left, belly_stiffness, chest_stiffness = total_forces(
            bones, plant, work, state, drive, activation, step, out
        )
        for k in range(n_dof):
            work.change[k] = step * work.tau[k]
        for p in range(state.soft.shape[0]):
            for c in range(3):
                work.change[n_dof + 3 * p + c] = step * work.f[bound + p, c]
        square = step * step
        solve_step(plant, work, square * belly_stiffness, square * chest_stiffness)
        fastest = _apply(bones, work, state, schedule)
        state.gas[0] = left
        if not fastest < schedule.speed_limit:
            return i
        if (i + 1) % schedule.record_every == 0 and frame < record.qpos.shape[0]:
            record.qpos[frame] = state.qpos
            record.soft[frame] = state.soft
            record.scalars[frame, :7] = out
            record.scalars[frame, 7] = work.gap.min() if work.gap.shape[0] > 0 else 0.0
            record.scalars[frame, 8] = fastest
            if record.tension.shape[0] > 0:
                record.tension[frame] = work.tension
            frame += 1
    return int(drive.activation.shape[0])


@compiled
def replay(
    bones: Bones,
    plant: Plant,
    work: Work,
    qpos: Floats,
    soft: Floats,
    chosen: Ints,
    position: Floats,
    rotation: Floats,
    points: Floats,
) -> None:
    """Kinematics of recorded frames.

    Parameters
    ----------
    qpos, soft : (n_frames, n_q) and (n_frames, n_particles, 3)
    chosen : (n,), point indices
    position, rotation, points : (n_frames, n_bodies, 3), (n_frames, n_bodies, 9) and
        (n_frames, n, 3), written
    """
    bound = plant.point_body.shape[0]
    for f in range(qpos.shape[0]):
        bones.qpos[:] = qpos[f]
        mj_kinematics(bones.model, bones.data)
        position[f] = bones.position
        rotation[f] = bones.rotation
        place_points(plant, bones.position, bones.rotation, work.x)
        work.x[bound:] = soft[f]
        for k in range(chosen.shape[0]):
            points[f, k] = work.x[chosen[k]]
