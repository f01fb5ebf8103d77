"""The first step of the calibration ladder: one rib swinging."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from sim import engine
from sim.bench import SPEED_LIMIT, Bench
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.joints import rotation_vector
from sim.physics.types import Floats
from sim.rest import GRAVITY, HOLD, no_record
from sim.resting import RestingTorso


@dataclass(frozen=True, kw_only=True, slots=True)
class Swing:
    """A rib let go: time (n,), s; angle about its neck (n,), rad; what the joint is made of."""

    time: Floats
    angle: Floats
    stiffness: float
    damping: float
    inertia: float

    @property
    def damping_ratio(self) -> float:
        """Damping over the critical one."""
        return float(self.damping / (2.0 * np.sqrt(self.stiffness * self.inertia)))

    def closed_form(self) -> Floats:
        """The oscillator of that stiffness, damping and inertia, (n,), rad."""
        rate = np.sqrt(self.stiffness / self.inertia)
        decay = np.sqrt(complex(self.damping_ratio**2 - 1.0))
        r1, r2 = -rate * (self.damping_ratio - decay), -rate * (self.damping_ratio + decay)
        part = r2 * np.exp(r1 * self.time) - r1 * np.exp(r2 * self.time)
        return np.asarray((self.angle[0] * part / (r2 - r1)).real)

    @property
    def distance(self) -> float:
        """Greatest distance from the closed form, of the start."""
        return float(np.abs(self.angle - self.closed_form()).max() / self.angle[0])


def rib_swing(resting: RestingTorso, rib: int = 5, start: float = 0.02) -> Swing:
    """(a) One rib alone, no muscle, tissue, pressure or weight, let go `start` rad off.

    Rib 5 has its joint's limit at 1 degree; `start` stays inside it.
    """
    bench = Bench(resting)
    plant, model = bench.plant, bench.torso.skeleton.model
    zero = np.zeros_like
    joints = plant.joints
    joints = joints._replace(ball_rest=zero(joints.ball_rest), hinge_rest=zero(joints.hinge_rest))
    m, t, k = plant.muscles, plant.tissue, plant.links
    bench.plant = plant._replace(
        joints=joints,
        muscles=m._replace(f_max=zero(m.f_max), k_pe=zero(m.k_pe), b_pe=zero(m.b_pe)),
        tissue=t._replace(stiffness=zero(t.stiffness), damping=zero(t.damping)),
        links=k._replace(along=zero(k.along), across=zero(k.across), damping=zero(k.damping)),
        particle_weight=zero(plant.particle_weight),
    )
    bench.constants(
        bulk_modulus=0.0, content_density=0.0, contact_stiffness=0.0, contact_damping=0.0
    )
    bench.pleural = 0.0
    joint = model.joint(f"rib_L{rib}")
    dof, address = int(joint.dofadr[0]), int(joint.qposadr[0])
    bench.locked[:] = HOLD
    bench.locked[dof : dof + 3] = 0.0
    which = int(np.flatnonzero(joints.ball_dof == dof)[0])
    values, vectors = np.linalg.eigh(joints.ball_stiffness[which])
    axis = vectors[:, 0]
    bench.state.qpos[:] = model.qpos0
    bench.state.qpos[address : address + 4] = [np.cos(start / 2), *(np.sin(start / 2) * axis)]
    n = 500
    inertia = _swing_inertia(model, f"rib_L{rib}", axis)
    angle = np.empty(n)
    out = np.empty(3)
    gravity = GRAVITY["upright"]
    model.opt.gravity[:] = 0.0
    drive = engine.make_drive(
        np.zeros((1, len(MUSCLE_GROUPS))), gravity=(0.0, 0.0, 0.0), locked=bench.locked, pleural=0.0
    )
    schedule = engine.Schedule(
        step=1e-3, refresh_every=1, record_every=2, drag=0.0, speed_limit=SPEED_LIMIT
    )
    for i in range(n):
        rotation_vector(bench.state.qpos[address : address + 4], out)
        angle[i] = out @ axis
        engine.run(
            bench.machine.bones, bench.plant, bench.machine.work, bench.state, schedule, drive,
            no_record(bench.torso),
        )  # fmt: skip
    model.opt.gravity[:] = gravity
    return Swing(
        time=np.arange(n, dtype=np.float64) * 1e-3, angle=angle, stiffness=float(values[0]),
        damping=float(axis @ joints.ball_damping[which] @ axis), inertia=inertia,
    )  # fmt: skip


def _swing_inertia(model: mujoco.MjModel, name: str, axis: Floats) -> float:
    """Inertia of a body about an axis through its joint, kg m^2."""
    body = model.body(name)
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, body.iquat)
    frame = rotation.reshape(3, 3)
    own = frame @ np.diag(body.inertia) @ frame.T
    arm = np.cross(axis, body.ipos)
    return float(axis @ own @ axis + body.mass[0] * (arm @ arm))
