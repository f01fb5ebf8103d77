"""One muscle between a frozen particle and a heavy one below it, advanced step by step.

The tensions are those of `sim.physics.muscle`. The linearly implicit step is the torso's
(`sim.engine`, `sim.physics.forces.muscle_masses`) for one particle on a vertical line; the two
others are there to be compared with it.
"""

from __future__ import annotations

from typing import NamedTuple

from sim.physics.compiled import compiled
from sim.physics.muscle import (
    SPRING,
    active_factor,
    active_slopes,
    hill_tension,
    passive_shape,
    spring_tension,
)
from sim.physics.types import Floats

IMPLICIT = 0
"""Forces at x + h v, matrix M + h D + h^2 K: the torso's step."""
EULER = 1
"""Explicit Euler, the published step (dilorenzo2009, section 3.2)."""
RUNGE_KUTTA = 2
"""The classical fourth-order step: the reference."""


class Muscle(NamedTuple):
    """One element and its load."""

    law: int
    rest: float
    """m"""
    strength: float
    """f_max, N (spring law: stiffness, N/m)"""
    k_pe: float
    """N (spring law: unused, the one spring is the active one)"""
    b_pe: float
    """N s (spring law: N s/m)"""
    v_max: float
    """1/s"""
    width: float
    curvature: float
    eccentric: float
    mass: float
    """kg"""
    gravity: float
    """m/s^2"""


@compiled
def tension(muscle: Muscle, command: float, place: float, speed: float) -> float:
    """Tension, N, never negative.

    Parameters
    ----------
    command : activation of the Hill law; rest length over `rest` of the spring law
    place, speed : of the lower particle, m and m/s, positive below the frozen one
    """
    length = abs(place)
    rate = speed if place >= 0.0 else -speed
    if muscle.law == SPRING:
        return spring_tension(
            1.0, length, rate, muscle.rest, command, muscle.strength, 0.0, muscle.b_pe
        )
    ratio, strain_rate = length / muscle.rest, rate / muscle.rest
    factor = active_factor(
        ratio, strain_rate / muscle.v_max, muscle.width, muscle.curvature, muscle.eccentric
    )
    return hill_tension(
        command * factor, ratio, strain_rate, muscle.strength, muscle.k_pe, muscle.b_pe
    )


@compiled
def _acceleration(muscle: Muscle, command: float, place: float, speed: float) -> float:
    """m/s^2, positive downwards."""
    pull = tension(muscle, command, place, speed)
    return muscle.gravity - (pull if place >= 0.0 else -pull) / muscle.mass


@compiled
def _matrix(muscle: Muscle, command: float, place: float, step: float) -> float:
    """Mass that the implicit step gives the particle, kg."""
    if muscle.law == SPRING:
        return muscle.mass + step * muscle.b_pe + step * step * muscle.strength
    ratio = abs(place) / muscle.rest
    k, d = active_slopes(ratio, muscle.width, muscle.curvature, muscle.v_max)
    k = muscle.k_pe * passive_shape(ratio)[1] + command * muscle.strength * k
    d = muscle.b_pe + command * muscle.strength * d
    return muscle.mass + (step * d + step * step * k) / muscle.rest


@compiled
def _runge_kutta(
    muscle: Muscle, command: float, place: float, speed: float, step: float
) -> tuple[float, float]:
    half = 0.5 * step
    a1 = _acceleration(muscle, command, place, speed)
    v2 = speed + half * a1
    a2 = _acceleration(muscle, command, place + half * speed, v2)
    v3 = speed + half * a2
    a3 = _acceleration(muscle, command, place + half * v2, v3)
    v4 = speed + step * a3
    a4 = _acceleration(muscle, command, place + step * v3, v4)
    moved = place + step * (speed + 2.0 * v2 + 2.0 * v3 + v4) / 6.0
    return moved, speed + step * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0


@compiled
def integrate(
    muscle: Muscle, scheme: int, step: float, command: Floats, held: int, start: float, out: Floats
) -> None:
    """Let the particle go and write its way.

    Parameters
    ----------
    command : (n_steps,), as `tension` takes it
    held : steps during which the particle is held where it starts
    start : place at the beginning, m
    out : (n_steps + 1, 3), written: place, m; speed, m/s; tension, N
    """
    place, speed = start, 0.0
    out[0, 0], out[0, 1] = place, speed
    out[0, 2] = tension(muscle, command[0], place, speed)
    for i in range(command.shape[0]):
        now = command[i]
        if i >= held:
            if scheme == RUNGE_KUTTA:
                place, speed = _runge_kutta(muscle, now, place, speed, step)
            elif scheme == EULER:
                before = speed
                speed += step * _acceleration(muscle, now, place, speed)
                place += step * before
            else:
                there = place + step * speed
                force = muscle.mass * _acceleration(muscle, now, there, speed)
                speed += step * force / _matrix(muscle, now, there, step)
                place += step * speed
        out[i + 1, 0], out[i + 1, 1] = place, speed
        out[i + 1, 2] = tension(muscle, now, place, speed)
