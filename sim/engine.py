"""The compiled step loop: MuJoCo for the bones, our kernels for everything soft.

MuJoCo gives kinematics, inertia and the bias of gravity and spin at the predicted pose; the
implicit step of `sim.physics.system` advances bones, particles and pressures together. The
loop holds no lock of the interpreter, so runs go side by side in threads, bit for bit alike.
"""

from __future__ import annotations

import numpy as np

from sim.bones import (
    Bones,
    mj_comPos,
    mj_comVel,
    mj_integratePos,
    mj_kinematics,
    mj_makeM,
    mj_rne,
)
from sim.drive import Drive, Record, Schedule, State, make_drive, make_record
from sim.physics.age import AHEAD, too_old
from sim.physics.ball import add_ball
from sim.physics.borrow import borrow
from sim.physics.cavities import add_cavities
from sim.physics.compiled import compiled, inner
from sim.physics.contact import add_contacts, follow_sheet
from sim.physics.forces import add_links, add_muscles, add_tissue
from sim.physics.joints import add_joints
from sim.physics.plant import Plant
from sim.physics.rigid import move_points, place_points, project
from sim.physics.system import refresh, solve_step
from sim.physics.types import Floats, Ints
from sim.physics.work import Work

__all__ = [
    "Drive",
    "Record",
    "Schedule",
    "State",
    "make_drive",
    "make_record",
    "predict",
    "replay",
    "run",
    "total_forces",
]

FAR = 0.03
"""m; once the fastest point has gone so far, contacts and arms differ: the matrix is renewed."""
FOLLOW_TIME = 0.008
"""s after which the diaphragm particles look for the face beside them."""
EASE_TIME = 0.05
"""s in which a layer of the rib cage takes hold of a particle that is behind it."""


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
    place_points(work.riders, plant.point_local, bones.position, bones.rotation, work.x)
    move_points(work.riders, plant.tree.body_root, work.x, bones.spatial, bones.centre, work.v)
    for p in range(state.soft.shape[0]):
        for c in range(3):
            work.x[bound + p, c] = state.soft[p, c] + step * state.soft_velocity[p, c]
            work.v[bound + p, c] = state.soft_velocity[p, c]


@inner
def add_elastic(bones: Bones, plant: Plant, work: Work, activation: Floats) -> None:
    """Forces of muscles, tissue, links and contact at the predicted place."""
    x, v, f = work.x, work.v, work.f
    add_muscles(x, v, plant.muscles, plant.constants, activation, work.fibres, f)
    add_tissue(x, v, plant.tissue, work.strings, f)
    add_links(x, v, plant.links, plant.point_body, bones.rotation, f)
    add_contacts(
        x, v, plant.contacts, plant.constants, work.held, work.ease, work.sheet_normal, work.gap, f
    )


@compiled
def total_forces(
    bones: Bones,
    plant: Plant,
    work: Work,
    state: State,
    drive: Drive,
    now: int,
    step: float,
    out: Floats,
) -> tuple[float, float, float]:
    """All forces at the predicted place: `work.tau` on the bones, `work.f` on the particles.

    A ball makes its step here too, as nothing else hangs on it.

    Parameters
    ----------
    now : step of the drive
    out : (7,), as `sim.physics.cavities.add_cavities` writes it
    """
    bound = plant.point_body.shape[0]
    work.f[:] = 0.0
    add_elastic(bones, plant, work, drive.activation[now])
    larynx = drive.larynx[min(now, drive.larynx.shape[0] - 1)]
    bend = drive.bend[min(now, drive.bend.shape[0] - 1)]
    result = add_cavities(
        plant, work, drive.gravity, drive.pleural, state.gas[0], larynx, step, out
    )
    add_ball(drive.ball, state.ball, drive.gravity, step, work.x, work.v, work.f)
    for k in range(plant.carried.shape[0]):
        for c in range(3):
            work.f[plant.carried[k], c] -= plant.carried_mass[k] * drive.gravity[c]
    project(
        work.riders, plant.tree, work.x, work.f, bones.centre, bones.motion, work.wrench, work.tau
    )
    add_joints(plant.joints, bend, bones.qpos, bones.qvel, work.tau)
    mj_rne(bones.model, bones.data, 0, work.bias.ctypes.data)
    for i in range(work.tau.shape[0]):
        work.tau[i] -= work.bias[i]
    for p in range(state.soft.shape[0]):
        for c in range(3):
            work.f[bound + p, c] += plant.particle_weight[p] * drive.gravity[c]
    return result


@inner
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
    # A comparison, which nothing that is not a number passes; `max` above skips such numbers.
    total = abs(state.qvel.sum() + state.soft_velocity.sum())
    return fastest if total < np.inf else np.inf


@inner
def _advance(
    bones: Bones,
    plant: Plant,
    work: Work,
    state: State,
    schedule: Schedule,
    drive: Drive,
    now: int,
    out: Floats,
) -> float:
    """Forces at the predicted place, and the step that they cause; returns the largest speed."""
    step = schedule.step
    n_dof, bound = state.qvel.shape[0], plant.point_body.shape[0]
    left, belly_stiffness, chest_stiffness = total_forces(
        bones, plant, work, state, drive, now, step, out
    )
    for k in range(n_dof):
        work.change[k] = step * work.tau[k]
    for p in range(state.soft.shape[0]):
        for c in range(3):
            work.change[n_dof + 3 * p + c] = step * work.f[bound + p, c]
    solve_step(
        plant.tree, plant.pattern, work.matrix, work.change,
        step * step * belly_stiffness, step * step * chest_stiffness,
    )  # fmt: skip
    state.gas[0] = left
    return _apply(bones, work, state, schedule)


@inner
def _keep(record: Record, frame: int, work: Work, state: State, out: Floats, speed: float) -> None:
    """Write a frame of the record."""
    record.qpos[frame] = state.qpos
    record.soft[frame] = state.soft
    record.scalars[frame, :7] = out
    record.ball[frame] = state.ball[:3]
    record.scalars[frame, 7] = work.gap.min() if work.gap.shape[0] > 0 else 0.0
    record.scalars[frame, 8] = speed
    if record.tension.shape[0] > 0:
        record.tension[frame] = work.fibres.tension


@inner
def _soon(activation: Floats, n: int) -> Floats:
    """Largest activation of each group from each step to `n` steps on, (n_steps, n_groups)."""
    out = activation.copy()
    for i in range(out.shape[0]):
        for k in range(i + 1, min(i + n, out.shape[0])):
            out[i] = np.maximum(out[i], activation[k])
    return out


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
    bones, plant, work = borrow(bones), borrow(plant), borrow(work)
    state, drive, record = borrow(state), borrow(drive), borrow(record)
    step, out = schedule.step, np.empty(7)
    soon = _soon(drive.activation, round(AHEAD / step))
    follow_every = max(1, round(FOLLOW_TIME / step))
    frame, gone, refreshed = 0, 0.0, -schedule.refresh_every
    for i in range(drive.activation.shape[0]):
        predict(bones, plant, work, state, step)
        if i % follow_every == 0:
            follow_sheet(
                work.x,
                plant.contacts,
                work.held,
                work.ease,
                step * follow_every / EASE_TIME,
                work.sheet_normal,
            )
        due = i - refreshed >= schedule.refresh_every or gone >= FAR
        if due or too_old(plant.muscles, work, soon[i]):
            refreshed, gone = i, 0.0
            work.f[:] = 0.0
            add_elastic(bones, plant, work, soon[i])
            mj_makeM(bones.model, bones.data)
            refresh(
                plant, work, step, soon[i], bones.mass, drive.locked,
                bones.centre, bones.motion,
            )  # fmt: skip
        fastest = _advance(bones, plant, work, state, schedule, drive, i, out)
        if not fastest < schedule.speed_limit:
            return i
        gone += step * fastest
        if (i + 1) % schedule.record_every == 0 and frame < record.qpos.shape[0]:
            _keep(record, frame, work, state, out, fastest)
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
        place_points(work.riders, plant.point_local, bones.position, bones.rotation, work.x)
        work.x[bound:] = soft[f]
        for k in range(chosen.shape[0]):
            points[f, k] = work.x[chosen[k]]
