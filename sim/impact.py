"""A heavy ball on the abdominal wall (dilorenzo2009, Fig. 3.6): contact, volume, return."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim import engine
from sim.errors import ParameterError, UnstableSimulation
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.ball import Ball
from sim.physics.types import Floats
from sim.rest import GRAVITY, Machine, bed, copy_state
from sim.resting import RestingTorso
from sim.simulate import REFRESH, SPEED_LIMIT

IMPACT_STEP = 0.0005
"""s; halving it changes depth and volume error by less than 2 % (tests/sim/test_impact.py)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Impact:
    """What a ball did.

    Parameters
    ----------
    time : (n,), s
    ball : (n, 3), centre of the ball, m
    wall : (n, n_points, 3), points of the abdominal wall, m
    start : (n_points, 3), the wall before
    radius : m, of the ball
    pressure : (n,), Pa, of the abdomen
    volume_error : (n,), abdomen's volume over that at rest, less one
    """

    time: Floats
    ball: Floats
    wall: Floats
    start: Floats
    radius: float
    pressure: Floats
    volume_error: Floats

    @property
    def dent(self) -> Floats:
        """(n,), farthest that any point of the wall is from its place before, m."""
        return np.asarray(np.linalg.norm(self.wall - self.start, axis=2).max(axis=1))


def drop_ball(
    resting: RestingTorso,
    *,
    mass: float,
    height: float,
    duration: float = 2.0,
    posture: str = "supine",
    step: float = IMPACT_STEP,
    rate: float = 200.0,
) -> Impact:
    """Let a ball fall on the navel of a relaxed torso.

    Parameters
    ----------
    mass : kg
    height : m, from the ball's lowest point to the skin, along gravity
    duration : s

    Raises
    ------
    UnstableSimulation
        if the run diverges
    """
    if not (mass > 0.0 and height > 0.0):
        raise ParameterError(f"ball: {mass} kg from {height} m. Give more than nothing of both.")
    rest = resting.rest(posture)
    torso, state, p = rest.torso, copy_state(rest.state), rest.torso.parameters
    radius = (3.0 * mass / (4.0 * np.pi * p["ball_density"])) ** (1.0 / 3.0)
    gravity = np.array(GRAVITY[posture])
    navel = resting.landmarks(posture)["NAVEL"]
    state.ball[:3] = navel - gravity / np.linalg.norm(gravity) * (radius + height)
    points = np.unique(torso.wall)
    ball = Ball(
        struck=points.astype(np.int64),
        reach=radius + torso.anatomy.belly_skin,
        mass=mass,
        stiffness=p["ball_stiffness"],
        damping=p["ball_damping"],
    )
    machine, n = Machine(torso), round(duration / step)
    machine.set_gravity(GRAVITY[posture])
    every = max(1, round(1.0 / (rate * step)))
    record = engine.make_record(n // every, n_q=machine.model.nq, n_particles=torso.n_particles)
    drive = engine.make_drive(
        np.zeros((n, len(MUSCLE_GROUPS))), gravity=GRAVITY[posture], locked=bed(torso, posture),
        ball=ball,
    )  # fmt: skip
    schedule = engine.Schedule(
        step=step, refresh_every=REFRESH, record_every=every, drag=0.0, speed_limit=SPEED_LIMIT
    )
    done = engine.run(machine.bones, torso.plant, machine.work, state, schedule, drive, record)
    if done < n:
        raise UnstableSimulation(f"the ball's run diverged at {done * step:.3f} s.", None)
    free = points[points >= torso.n_bound] - torso.n_bound
    volume = record.scalars[:, 2]
    return Impact(
        time=np.arange(1, len(volume) + 1, dtype=np.float64) * (every * step),
        ball=record.ball,
        wall=record.soft[:, free],
        start=rest.state.soft[free],
        radius=radius,
        pressure=record.scalars[:, 5],
        volume_error=volume / volume[0] - 1.0,
    )
