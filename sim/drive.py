"""What a run starts from, what drives it and what it leaves behind, as flat arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.errors import ParameterError
from sim.physics.ball import Ball
from sim.physics.types import Floats


class State(NamedTuple):
    """What changes during a run."""

    qpos: Floats
    qvel: Floats
    soft: Floats
    soft_velocity: Floats
    """(n_particles, 3), m and m/s"""
    gas: Floats
    """(1,), pressure times volume of the gas in the lung, Pa m^3"""
    ball: Floats
    """(6,), place and velocity of a ball that falls on the wall, m and m/s"""


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
    larynx: Floats
    """(n_steps,) or (1,) for all of them, Pa s/m^3, what the larynx adds to the airway"""
    bend: Floats
    """(n_steps, n, 3) or (1, n, 3), rad, rotation vectors by which the slack poses of the first n
    ball joints (the spine from below) are turned"""
    ball: Ball


NO_BALL = Ball(struck=np.zeros(0, dtype=np.int64), reach=0.0, mass=1.0, stiffness=0.0, damping=0.0)


def make_drive(
    activation: Floats,
    *,
    gravity: tuple[float, float, float],
    locked: Floats,
    pleural: float = np.nan,
    larynx: Floats | None = None,
    bend: Floats | None = None,
    ball: Ball = NO_BALL,
) -> Drive:
    """A drive with an open larynx and a straight back, unless they are given.

    Raises
    ------
    ParameterError
        if larynx or bend are not as long as the activation
    """
    for name, given in (("larynx", larynx), ("bend", bend)):
        if given is not None and len(given) not in (1, len(activation)):
            raise ParameterError(
                f"{name} has {len(given)} steps, activation {len(activation)}. Give both the same."
            )
    return Drive(
        activation=np.ascontiguousarray(activation, dtype=float),
        gravity=np.array(gravity, dtype=float),
        locked=locked,
        pleural=pleural,
        larynx=np.zeros(1) if larynx is None else np.ascontiguousarray(larynx, dtype=float),
        bend=np.zeros((1, 0, 3)) if bend is None else np.ascontiguousarray(bend, dtype=float),
        ball=ball,
    )


class Record(NamedTuple):
    """What a run leaves behind, a row a recorded frame."""

    qpos: Floats
    soft: Floats
    scalars: Floats
    """(n_frames, 9): lung, chest, abdomen volume; alveolar, pleural, abdominal pressure;
    flow out; least contact gap; largest speed"""
    tension: Floats
    """(n_frames, n_elements) or empty"""
    ball: Floats
    """(n_frames, 3), m"""


def make_record(n_frames: int, *, n_q: int, n_particles: int, n_elements: int = 0) -> Record:
    """Room for frames; without elements the tensions are not kept."""
    return Record(
        qpos=np.zeros((n_frames, n_q)),
        soft=np.zeros((n_frames, n_particles, 3)),
        scalars=np.zeros((n_frames, 9)),
        tension=np.zeros((n_frames if n_elements else 0, n_elements)),
        ball=np.zeros((n_frames, 3)),
    )
