"""The steps (a) to (d) of the calibration ladder: experiments on the torso at rest.

Each experiment starts from the solved rest and lets the torso come to equilibrium under drag, so
that a curve is static. Nothing here changes a parameter of the torso; an experiment holds bodies,
particles, the pleural pressure or the airway.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from sim import engine
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.joints import rotation_vector
from sim.physics.plant import Plant
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats, Ints
from sim.rest import GRAVITY, HOLD, Machine, RestState, bed, copy_state, no_record
from sim.resting import RestingTorso

CMH2O = 98.0665
STEP = 0.002
DRAG = 6.0
SPEED_LIMIT = 20.0
CLOSED = 1e12
"""Airway resistance of a closed airway, Pa s/m^3."""
SUBSTEPS = 20
"""Parts into which a change of pressure or gas is cut, so that the torso follows it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Point:
    """A static state, against the start of its experiment.

    Parameters
    ----------
    lung, chest, abdomen : volumes, m^3
    alveolar, pleural, abdominal : pressures, Pa
    rib_cage, wall : volume swept by the rib cage (apposed part included) and by the belly, m^3
    places : (n_points, 3), m
    """

    lung: float
    chest: float
    abdomen: float
    alveolar: float
    pleural: float
    abdominal: float
    rib_cage: float
    wall: float
    places: Floats


def swept(before: Floats, after: Floats, faces: Ints) -> float:
    """Volume that faces sweep outwards between two near states, m^3."""
    middle = 0.5 * (before + after)
    a, b, c = middle[faces[:, 0]], middle[faces[:, 1]], middle[faces[:, 2]]
    area = 0.5 * np.cross(b - a, c - a)
    move = (after - before)[faces].mean(axis=1)
    return float((area * move).sum())


class Bench:
    """A torso on which one experiment is made; state and swept volumes go on from call to call."""

    def __init__(self, resting: RestingTorso, posture: str = "upright") -> None:
        rest: RestState = resting.rest(posture)
        self.torso, self.posture = rest.torso, posture
        self.plant: Plant = rest.torso.plant
        self.machine, self.state = Machine(rest.torso), copy_state(rest.state)
        self.locked = bed(rest.torso, posture)
        self.pleural = np.nan
        self.places = rest.points.copy()
        self.rib_cage = self.wall = 0.0
        dome = {tuple(sorted(f)) for f in self.plant.chest_faces.tolist()}
        belly = self.plant.abdomen_faces
        self.wall_faces = belly[[tuple(sorted(f)) not in dome for f in belly.tolist()]]
        both = {tuple(sorted(f)) for f in belly.tolist()}
        chest = self.plant.chest_faces
        self.rib_faces = chest[[tuple(sorted(f)) not in both for f in chest.tolist()]]

    def constants(self, **changes: float) -> None:
        """Change constants of this experiment."""
        self.plant = self.plant._replace(constants=self.plant.constants._replace(**changes))

    def close_airway(self) -> None:
        """No flow from here on."""
        self.constants(airway_k1=CLOSED, airway_k2=0.0)

    def go(
        self, duration: float, levels: dict[str, float] | None = None, drag: float = DRAG
    ) -> Point:
        """Run on for `duration` s with constant activations and say where it stands."""
        n = round(duration / STEP)
        activation = np.zeros((n, len(MUSCLE_GROUPS)))
        for group, level in (levels or {}).items():
            activation[:, MUSCLE_GROUPS.index(group)] = level
        gravity = GRAVITY[self.posture]
        drive = engine.make_drive(
            activation, gravity=gravity, locked=self.locked, pleural=self.pleural
        )
        schedule = engine.Schedule(
            step=STEP, refresh_every=10, record_every=n, drag=drag, speed_limit=SPEED_LIMIT
        )
        record = engine.make_record(1, n_q=len(self.state.qpos), n_particles=self.torso.n_particles)
        self.machine.set_gravity(gravity)
        work = self.machine.work
        done = engine.run(self.machine.bones, self.plant, work, self.state, schedule, drive, record)
        if done < n:
            raise SystemExit(f"calibration: the torso diverged after {done * STEP:.3f} s.")
        engine.predict(self.machine.bones, self.plant, work, self.state, 0.0)
        return self._stand(record.scalars[0])

    def _stand(self, scalars: Floats) -> Point:
        x = self.machine.work.x.copy()
        self.rib_cage += swept(self.places, x, self.rib_faces)
        self.wall += swept(self.places, x, self.wall_faces)
        self.places = x
        lung, chest, abdomen, alveolar, pleural, abdominal = (float(s) for s in scalars[:6])
        return Point(
            lung=lung, chest=chest, abdomen=abdomen, alveolar=alveolar, pleural=pleural,
            abdominal=abdominal, rib_cage=self.rib_cage, wall=self.wall, places=x,
        )  # fmt: skip

    def ramp(self, duration: float, levels: dict[str, float], hold: float) -> Point:
        """Raise activations from nothing in `SUBSTEPS` stairs, then hold them."""
        for k in range(1, SUBSTEPS + 1):
            share = {g: level * k / SUBSTEPS for g, level in levels.items()}
            self.go(duration / SUBSTEPS, share)
        return self.go(hold, levels)


@dataclass(frozen=True, kw_only=True, slots=True)
class Swing:
    """A rib let go: time (n,), s; angle about its neck (n,), rad; what the joint is made of."""

    time: Floats
    angle: Floats
    stiffness: float
    damping: float
    inertia: float


def rib_swing(resting: RestingTorso, rib: int = 5, start: float = 0.1) -> Swing:
    """(a) One rib alone, no muscle, tissue, pressure or weight, let go `start` rad off."""
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
        time=np.arange(n) * 1e-3, angle=angle, stiffness=float(values[0]),
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


def belly_inflation(
    resting: RestingTorso, volumes: Floats, *, wall_alone: bool
) -> tuple[list[Point], Point]:
    """(b) Supine and relaxed, the contents of the belly grow.

    Parameters
    ----------
    volumes : (n,), contents added, m^3, rising
    wall_alone : hold bones and diaphragm

    Returns
    -------
    a point for each volume; the start
    """
    bench = Bench(resting, "supine")
    if wall_alone:
        bench.locked[:] = HOLD
        dome = bench.torso.diaphragm.ravel()
        dome = dome[dome >= bench.torso.n_bound] - bench.torso.n_bound
        inertia = bench.plant.particle_inertia.copy()
        inertia[dome] = HOLD
        bench.plant = bench.plant._replace(particle_inertia=inertia)
    start = bench.go(1.0)
    base, points, last = bench.plant.constants.abdomen_volume, [], 0.0
    for volume in volumes:
        for k in range(1, SUBSTEPS + 1):
            bench.constants(abdomen_volume=base + last + (volume - last) * k / SUBSTEPS)
            bench.go(0.05)
        last = float(volume)
        points.append(bench.go(2.0))
    return points, start


def relaxation(resting: RestingTorso, pressures: Floats, posture: str) -> list[Point]:
    """(c) The relaxed chest wall at pleural pressures (n,), Pa, from rest outwards.

    The first point of each way out is that of rest itself, at its own pleural pressure.
    """
    found: dict[float, Point] = {}
    for sign in (-1.0, 1.0):
        bench = Bench(resting, posture)
        last = rest = bench.go(1.0).pleural
        bench.pleural = rest
        found[rest] = bench.go(3.0)
        for p in sorted((q for q in pressures if sign * (q - rest) > 0.0), key=lambda q: sign * q):
            for k in range(1, SUBSTEPS + 1):
                bench.pleural = last + (p - last) * k / SUBSTEPS
                bench.go(0.1)
            bench.pleural = last = float(p)
            found[last] = bench.go(5.0)
    return [found[p] for p in sorted(found)]


def at_volume(resting: RestingTorso, volume: float) -> Bench:
    """A relaxed torso whose lung is filled or emptied to about `volume`, airway closed."""
    bench = Bench(resting)
    bench.close_airway()
    here = resting.torso.plant.constants
    now = enclosed_volume(bench.places, bench.plant.chest_faces) - here.tissue_volume
    start, end = bench.state.gas[0], bench.state.gas[0] + here.atmosphere * (volume - now)
    for k in range(1, 2 * SUBSTEPS + 1):
        bench.state.gas[0] = start + (end - start) * k / (2 * SUBSTEPS)
        bench.go(0.05)
    bench.go(3.0)
    return bench


def diaphragm_alone(
    resting: RestingTorso, volumes: Floats, level: float, *, braced: bool
) -> list[tuple[Point, Point]]:
    """(d) The diaphragm contracts against a closed airway at volumes (n,), m^3: before, during.

    Parameters
    ----------
    braced : hold the bones but for the central tendon, as other muscles do in a maximal effort
    """
    out = []
    for volume in volumes:
        bench = at_volume(resting, float(volume))
        if braced:
            bench.locked[:] = HOLD
            start = int(bench.torso.skeleton.model.joint("central_tendon").dofadr[0])
            bench.locked[start : start + 6] = 0.0
        before = bench.go(0.5)
        out.append((before, bench.ramp(1.0, {"diaphragm": level}, hold=2.0)))
    return out


def open_effort(resting: RestingTorso, levels: dict[str, float]) -> tuple[Point, Point]:
    """The same muscles with the airway open: before and during."""
    bench = Bench(resting)
    before = bench.go(0.5)
    return before, bench.ramp(1.0, levels, hold=4.0)
