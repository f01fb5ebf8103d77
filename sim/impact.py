"""A heavy ball on the abdominal wall (dilorenzo2009, Fig. 3.6): contact, volume, return."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim import engine
from sim.errors import ParameterError, UnstableSimulation
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import Torso
from sim.physics.ball import Ball
from sim.physics.types import Floats
from sim.rest import GRAVITY, Machine, bed, copy_state
from sim.resting import RestingTorso
from sim.simulate import REFRESH, SPEED_LIMIT

IMPACT_STEP = 0.00025
"""s; halving it changes depth and volume error by less than 2 % (tests/sim/test_impact.py)."""

AWAY = 1e3
"""s^2; times gravity, how far a caught ball is taken."""


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
    """Let a ball fall on the navel of a relaxed torso and catch it when it has bounced.

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
    machine = Machine(torso)
    machine.set_gravity(GRAVITY[posture])
    every = max(1, round(1.0 / (rate * step)))
    frames, caught = [], False
    for frame in range(round(duration / step) // every):
        record = _run(machine, torso, state, ball, posture, step, every)
        if record is None:
            raise UnstableSimulation(f"the ball's run diverged by {frame * every * step:.3f} s.")
        frames.append(record)
        rise = -float(state.ball[3:] @ gravity)
        if not caught and rise > 0.0 and _clear(ball, state, torso):
            state.ball[:] = [*(state.ball[:3] - AWAY * gravity), 0.0, 0.0, 0.0]
            caught = True
    free = points[points >= torso.n_bound] - torso.n_bound
    scalars = np.concatenate([r.scalars for r in frames])
    return Impact(
        time=np.arange(1, len(frames) + 1, dtype=np.float64) * (every * step),
        ball=np.concatenate([r.ball for r in frames]),
        wall=np.concatenate([r.soft for r in frames])[:, free],
        start=rest.state.soft[free],
        radius=radius,
        pressure=scalars[:, 5],
        volume_error=scalars[:, 2] / scalars[0, 2] - 1.0,
    )


def _run(
    machine: Machine,
    torso: Torso,
    state: engine.State,
    ball: Ball,
    posture: str,
    step: float,
    n: int,
) -> engine.Record | None:
    """One frame of `n` steps, or nothing if it diverges."""
    record = engine.make_record(1, n_q=machine.model.nq, n_particles=torso.n_particles)
    drive = engine.make_drive(
        np.zeros((n, len(MUSCLE_GROUPS))), gravity=GRAVITY[posture], locked=bed(torso, posture),
        ball=ball,
    )  # fmt: skip
    schedule = engine.Schedule(
        step=step, refresh_every=REFRESH, record_every=n, drag=0.0, speed_limit=SPEED_LIMIT
    )
    done = engine.run(machine.bones, torso.plant, machine.work, state, schedule, drive, record)
    return record if done == n else None


def _clear(ball: Ball, state: engine.State, torso: Torso) -> bool:
    """Whether the ball touches no free point of the wall."""
    free = ball.struck[ball.struck >= torso.n_bound] - torso.n_bound
    gap = np.linalg.norm(state.soft[free] - state.ball[:3], axis=1) - ball.reach
    return bool(gap.min() > 0.0)
