"""A ball that falls on the abdominal wall (dilorenzo2009, Fig. 3.6)."""

from __future__ import annotations

import math
from typing import NamedTuple

from sim.physics.compiled import compiled
from sim.physics.types import Floats, Ints


class Ball(NamedTuple):
    """A ball and what it can strike."""

    struck: Ints
    """(n,), points of the wall; none where there is no ball"""
    reach: float
    """m, radius and skin: nearer than this to a point, the ball touches"""
    mass: float
    stiffness: float
    """N/m, of one point's contact"""
    damping: float
    """N s/m"""


@compiled
def add_ball(ball: Ball, state: Floats, gravity: Floats, step: float, x: Floats, v: Floats,
             f: Floats) -> None:  # fmt: skip
    """Contact of the ball with the points that it strikes, and the ball's own step.

    The push acts along the line of centres, without friction and never pulls; what the points
    feel, the ball feels the other way.

    Parameters
    ----------
    state : (6,), place and velocity of the centre, m and m/s, advanced
    x, v : (n_points, 3), m and m/s
    f : (n_points, 3), N, added to
    """
    if ball.struck.shape[0] == 0:
        return
    px, py, pz = 0.0, 0.0, 0.0
    for k in range(ball.struck.shape[0]):
        p = ball.struck[k]
        dx = x[p, 0] - (state[0] + step * state[3])
        dy = x[p, 1] - (state[1] + step * state[4])
        dz = x[p, 2] - (state[2] + step * state[5])
        away = math.sqrt(dx * dx + dy * dy + dz * dz)
        depth = ball.reach - away
        if depth <= 0.0:
            continue
        dx, dy, dz = dx / away, dy / away, dz / away
        closing = (state[3] - v[p, 0]) * dx + (state[4] - v[p, 1]) * dy + (state[5] - v[p, 2]) * dz
        push = max(0.0, ball.stiffness * depth + ball.damping * closing)
        f[p, 0] += push * dx
        f[p, 1] += push * dy
        f[p, 2] += push * dz
        px, py, pz = px - push * dx, py - push * dy, pz - push * dz
    state[3] += step * (gravity[0] + px / ball.mass)
    state[4] += step * (gravity[1] + py / ball.mass)
    state[5] += step * (gravity[2] + pz / ball.mass)
    for c in range(3):
        state[c] += step * state[3 + c]
