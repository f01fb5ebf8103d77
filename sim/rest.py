"""The resting equilibrium: solved, so that nothing pulls without a cause.

The built pose is the upright torso at functional residual capacity. Soft parts settle first
with the bones held; then the slack angles of the joints and the slack of the links are solved
so that the bones stay where they are. Lying down keeps all of that and turns gravity only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from sim import engine
from sim.bones import view_bones
from sim.errors import ParameterError, UnstableSimulation
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.skeleton import SEGMENTS
from sim.model.torso import Torso, lung_capacity
from sim.physics.plant import Links, Plant
from sim.physics.rigid import project
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats
from sim.physics.work import Work, make_work

GRAVITY = {"upright": (0.0, 0.0, -9.81), "supine": (-9.81, 0.0, 0.0)}
SETTLE_STEP = 0.004
SETTLE_DRAG = 6.0
FIRST_DRAG = 60.0
SETTLE_STAGES = ((0.5, FIRST_DRAG), *((0.6, 12.0),) * 8)
"""Duration, s, and drag, 1/s: the built pose is some way off, so the first is stiff as honey."""
LAST_STAGE = 6.0
"""s with the true bulk modulus; after 2 s the wall of a small woman still crept by 2 mm."""
HOLD = 1e9
"""Mass that holds a degree of freedom in place."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RestState:
    """A torso at rest in a posture.

    Parameters
    ----------
    torso : with slack angles, slack lengths and reference volumes solved
    posture : "upright" or "supine"
    state : where everything is
    points : (n_points, 3), m
    """

    torso: Torso
    posture: str
    state: engine.State
    points: Floats


class Machine:
    """MuJoCo data, views and scratch of one run at a time."""

    def __init__(self, torso: Torso) -> None:
        self.model = torso.skeleton.model
        self.data = mujoco.MjData(self.model)
        self.bones = view_bones(self.model, self.data)
        self.work: Work = make_work(torso.plant)
        self.set_gravity(GRAVITY["upright"])

    def set_gravity(self, gravity: tuple[float, float, float]) -> None:
        """Gravity of the bones; each run sets it, as all runs of a torso share the model."""
        self.model.opt.gravity[:] = gravity


def bed(torso: Torso, posture: str) -> Floats:
    """(n_dof,), what holds the torso besides the pelvis: lying, the bed holds the spine."""
    model = torso.skeleton.model
    locked = np.zeros(model.nv)
    if posture == "supine":
        for name in (*SEGMENTS, "skull"):
            start = int(model.joint(name).dofadr[0])
            locked[start : start + 3] = HOLD
    return locked


def new_state(torso: Torso) -> engine.State:
    """The built pose, at rest, the lung at atmospheric pressure."""
    model, k = torso.skeleton.model, torso.plant.constants
    chest = enclosed_volume(torso.places, torso.plant.chest_faces)
    return engine.State(
        qpos=model.qpos0.copy(),
        qvel=np.zeros(model.nv),
        soft=torso.places[torso.n_bound :].copy(),
        soft_velocity=np.zeros((torso.n_particles, 3)),
        gas=np.array([k.atmosphere * (chest - k.tissue_volume)]),
        ball=np.zeros(6),
    )


def copy_state(state: engine.State) -> engine.State:
    """An independent copy."""
    return engine.State(*(part.copy() for part in state))


def no_record(torso: Torso) -> engine.Record:
    """A record that keeps nothing."""
    return engine.make_record(0, n_q=torso.skeleton.model.nq, n_particles=torso.n_particles)


def settle(
    torso: Torso,
    machine: Machine,
    state: engine.State,
    plant: Plant,
    gravity: tuple[float, float, float],
    *,
    duration: float,
    locked: Floats,
    pleural: float,
    drag: float = SETTLE_DRAG,
) -> None:
    """Let `state` come to rest under heavy drag; raises if it diverges."""
    n = round(duration / SETTLE_STEP)
    silent = np.zeros((n, len(MUSCLE_GROUPS)))
    drive = engine.make_drive(silent, gravity=gravity, locked=locked, pleural=pleural)
    schedule = engine.Schedule(
        step=SETTLE_STEP, refresh_every=50, record_every=n + 1, drag=drag, speed_limit=20.0
    )
    machine.set_gravity(gravity)
    done = engine.run(machine.bones, plant, machine.work, state, schedule, drive, no_record(torso))
    if done < n:
        raise UnstableSimulation(
            f"the torso does not settle: diverged after {done * SETTLE_STEP:.3f} s. "
            "Check stature, mass and scale of the subject."
        )


def residual(
    machine: Machine, plant: Plant, state: engine.State, gravity: tuple[float, float, float],
    pleural: float,
) -> Floats:  # fmt: skip
    """(n_dof,), generalised forces on the resting bones, N and N m."""
    silent, free = np.zeros((1, len(MUSCLE_GROUPS))), np.zeros(len(state.qvel))
    drive = engine.make_drive(silent, gravity=gravity, locked=free, pleural=pleural)
    machine.set_gravity(gravity)
    engine.predict(machine.bones, plant, machine.work, state, 0.0)
    engine.total_forces(machine.bones, plant, machine.work, state, drive, 0, 1e-3, np.empty(7))
    return machine.work.tau.copy()


def _free_tendon(torso: Torso) -> Floats:
    locked = np.full(torso.skeleton.model.nv, HOLD)
    joint = torso.skeleton.model.joint("central_tendon")
    start = int(joint.dofadr[0])
    locked[start : start + 6] = 0.0
    return locked


def _settle_soft(torso: Torso, machine: Machine, pleural: float) -> tuple[Plant, engine.State]:
    """Settle the soft parts and find the volume of the contents that keeps the dome in place.

    The contents are soft while their volume is sought, so that a change of it moves the walls
    gently; then the true bulk modulus takes over at the same pressure.
    """
    p, plant, state = torso.parameters, torso.plant, new_state(torso)
    z = int(torso.skeleton.model.joint("central_tendon").qposadr[0]) + 2
    level = float(state.qpos[z])
    area = float(np.pi * np.prod(np.ptp(torso.places[torso.diaphragm[:, 0], :2], axis=0)) / 4.0)
    soft = p["settling_modulus"]
    volume = plant.constants.abdomen_volume * (1.0 + p["settling_pressure"] / soft)
    for duration, drag in SETTLE_STAGES:
        plant = _fill(plant, volume, soft)
        settle(torso, machine, state, plant, GRAVITY["upright"], duration=duration,
               locked=_free_tendon(torso), pleural=pleural, drag=drag)  # fmt: skip
        if drag < FIRST_DRAG:
            volume += area * (level - float(state.qpos[z]))
    now = enclosed_volume(machine.work.x, plant.abdomen_faces)
    pressure = soft * (plant.constants.abdomen_volume / now - 1.0)
    plant = _fill(plant, now * (1.0 + pressure / p["bulk_modulus"]), p["bulk_modulus"])
    settle(torso, machine, state, plant, GRAVITY["upright"], duration=LAST_STAGE,
           locked=_free_tendon(torso), pleural=pleural)  # fmt: skip
    return plant, state


def _fill(plant: Plant, volume: float, modulus: float) -> Plant:
    constants = plant.constants._replace(abdomen_volume=volume, bulk_modulus=modulus)
    return plant._replace(constants=constants)


def _slacken(torso: Torso, machine: Machine, plant: Plant, state: engine.State) -> Plant:
    """Solve slack angles and link slack so that the bones are in balance as they stand.

    Shifting a link's slack shifts its line of action a little, so the solve is repeated.
    """
    model, pleural = torso.skeleton.model, torso.parameters["end_expiratory_pleural"]
    sternum = int(model.joint("sternum").dofadr[0])
    fixed = np.concatenate([np.arange(sternum, sternum + 6), plant.joints.hinge_dof])
    for _ in range(4):
        joints, links = plant.joints, plant.links
        tau = residual(machine, plant, state, GRAVITY["upright"], pleural)
        rows = _link_rows(torso, machine, plant)
        pull = np.linalg.lstsq(rows[:, fixed].T, -tau[fixed], rcond=None)[0]
        tau += rows.T @ pull
        ball = joints.ball_dof[:, None] + np.arange(3)
        rest = (
            joints.ball_rest - np.linalg.solve(joints.ball_stiffness, tau[ball][..., None])[..., 0]
        )
        hinge = joints.hinge_rest - tau[joints.hinge_dof] / joints.hinge_stiffness
        local = plant.point_local.copy()
        local[links.a] -= _link_stretch(links, pull.reshape(-1, 3))
        plant = plant._replace(
            joints=joints._replace(ball_rest=rest, hinge_rest=hinge), point_local=local
        )
    return plant


def _link_stretch(links: Links, pull: Floats) -> Floats:
    """(n, 3), how far each link gives under a pull; bodies stand as built, axes parallel."""
    along = (links.axis * pull).sum(axis=1, keepdims=True) * links.axis
    return np.asarray(along / links.along[:, None] + (pull - along) / links.across[:, None])


def _link_rows(torso: Torso, machine: Machine, plant: Plant) -> Floats:
    """(3 n_links, n_dof), generalised force of a unit pull of each link, a towards b."""
    links, work, bones = plant.links, machine.work, machine.bones
    rows = np.zeros((3 * len(links.a), torso.skeleton.model.nv))
    for e, (a, b) in enumerate(zip(links.a, links.b, strict=True)):
        for c in range(3):
            force = np.zeros_like(work.f)
            force[a, c], force[b, c] = 1.0, -1.0
            out = np.zeros(rows.shape[1])
            project(
                work.riders, plant.tree, work.x, force, bones.centre, bones.motion, work.wrench, out
            )
            rows[3 * e + c] = out
    return rows


def solve_rest(torso: Torso) -> RestState:
    """Upright rest: settle the soft parts, then balance the bones.

    Raises
    ------
    UnstableSimulation
        if the soft parts do not settle
    """
    machine = Machine(torso)
    pleural = torso.parameters["end_expiratory_pleural"]
    plant, state = _settle_soft(torso, machine, pleural)
    plant = _slacken(torso, machine, plant, state)
    engine.predict(machine.bones, plant, machine.work, state, 0.0)
    points = machine.work.x.copy()
    capacity = lung_capacity(torso.subject)["frc"]
    tissue = enclosed_volume(points, plant.chest_faces) - capacity
    constants = plant.constants._replace(tissue_volume=tissue)
    state.gas[0] = constants.atmosphere * capacity
    state.qvel[:] = 0.0
    state.soft_velocity[:] = 0.0
    solved = replace(torso, plant=plant._replace(constants=constants))
    return RestState(torso=solved, posture="upright", state=state, points=points)


def lie_down(rest: RestState, posture: str, duration: float = 8.0) -> RestState:
    """The same torso at rest in another posture: only gravity turns."""
    if posture not in GRAVITY:
        raise ParameterError(f"posture is {posture!r}. Use {' or '.join(GRAVITY)}.")
    if posture == rest.posture:
        return rest
    torso = rest.torso
    machine, state = Machine(torso), copy_state(rest.state)
    settle(torso, machine, state, torso.plant, GRAVITY[posture], duration=duration,
           locked=bed(torso, posture), pleural=np.nan)  # fmt: skip
    state.qvel[:] = 0.0
    state.soft_velocity[:] = 0.0
    engine.predict(machine.bones, torso.plant, machine.work, state, 0.0)
    return RestState(torso=torso, posture=posture, state=state, points=machine.work.x.copy())
