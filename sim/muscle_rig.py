"""The rig of the dissertation's muscle comparison: one muscle, one particle, gravity.

dilorenzo2009 section 4.3. The numbers are rows of `sim/data/muscle_rig.csv`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.physics.muscle import HILL, SPRING
from sim.physics.one_muscle import IMPLICIT, Muscle, integrate, tension
from sim.physics.types import Floats
from sim.tables import Parameters, parameters, read_rows

LAWS = {"spring": SPRING, "hill": HILL}
RELAXED = {"spring": 1.0, "hill": 0.0}
"""Command of a muscle at rest: its own length, or no activation."""
CONTRACTED = {"spring": 0.0, "hill": 1.0}
"""Command of full activation: r(t) = 0 or a(t) = 1."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Motion:
    """What the particle did.

    Parameters
    ----------
    time : (n,), s
    place : (n,), m, below the frozen particle; negative above it
    speed : (n,), m/s, downwards, so lengthening while the particle is below
    tension : (n,), N
    command : (n,), activation (Hill) or desired length over rest length (spring)
    """

    time: Floats
    place: Floats
    speed: Floats
    tension: Floats
    command: Floats


def rig_numbers() -> Parameters:
    """Numbers of the rig."""
    return Parameters(
        numbers={row["name"]: float(row["value"]) for row in read_rows("muscle_rig.csv")}
    )


def make_muscle(
    law: str, numbers: Parameters, *, eccentric: float = 0.0, loaded: bool = True
) -> Muscle:
    """The muscle of a law with its particle.

    Parameters
    ----------
    law : "spring" or "hill"
    eccentric : force of a lengthening Hill muscle over isometric; 0 as printed
    loaded : gravity acts
    """
    shape = parameters()
    spring = law == "spring"
    return Muscle(
        law=LAWS[law],
        rest=numbers["rest_length"],
        strength=numbers["spring_k" if spring else "hill_f_max"],
        k_pe=0.0 if spring else numbers["hill_k_pe"],
        b_pe=numbers["spring_b" if spring else "hill_b_pe"],
        v_max=numbers["hill_v_max"],
        width=shape["hill_width"],
        curvature=shape["hill_curvature"],
        eccentric=eccentric,
        mass=numbers["mass"],
        gravity=numbers["gravity"] if loaded else 0.0,
    )


def hanging_length(muscle: Muscle, command: float, low: float, high: float) -> float:
    """Length, m, at which the tension carries the particle, by bisection between two lengths."""
    weight = muscle.mass * muscle.gravity
    rises = tension(muscle, command, high, 0.0) > weight
    for _ in range(60):
        middle = 0.5 * (low + high)
        if (tension(muscle, command, middle, 0.0) > weight) == rises:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def move(
    muscle: Muscle,
    command: Floats,
    *,
    start: float,
    step: float,
    held: float = 0.0,
    scheme: int = IMPLICIT,
) -> Motion:
    """Let the particle move under a command.

    Parameters
    ----------
    command : (n_steps,), of each step
    start : place at the beginning, m
    step : s
    held : time for which the particle is held where it starts, s
    """
    out = np.empty((len(command) + 1, 3))
    integrate(muscle, scheme, step, command, round(held / step), start, out)
    return Motion(
        time=np.arange(len(out), dtype=np.float64) * step,
        place=out[:, 0],
        speed=out[:, 1],
        tension=out[:, 2],
        command=np.append(command[:1], command),
    )
