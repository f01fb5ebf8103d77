"""One place through which the validation asks the torso to do something."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.errors import ParameterError
from sim.motion import Motion, motion, rest_motion
from sim.resting import RestingTorso
from sim.simulate import Trajectory, simulate
from sim.styles import read_styles

FRAME_RATE = 25.0
"""Frames a second to keep of a breath."""
STEP = 0.001
"""s, half of that of `pleura simulate`: at 2 ms a full supine inspiration of the man chatters."""


class MissingBehaviour(ParameterError):
    """The torso cannot do this yet."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Run:
    """A behaviour as it was simulated.

    Parameters
    ----------
    posture : "upright" or "supine"
    rate : breaths a second
    rest : the torso at rest in the same posture, one frame
    """

    posture: str
    rate: float
    trajectory: Trajectory
    motion: Motion
    rest: Motion


def run_behaviour(name: str, resting: RestingTorso, posture: str) -> Run:
    """Simulate a behaviour for its own duration, from rest.

    Raises
    ------
    MissingBehaviour
        if the torso has no such behaviour
    """
    styles = read_styles()
    if name not in styles:
        raise MissingBehaviour(f"the behaviour '{name}' is not there yet")
    style = styles[name]
    activation = style.activation(style.duration, STEP)
    trajectory = simulate(resting, activation, posture=posture, step=STEP, rate=FRAME_RATE)
    return Run(
        posture=posture,
        rate=float(np.round(style.rate, 12)),
        trajectory=trajectory,
        motion=motion(resting, trajectory, posture=posture),
        rest=rest_motion(resting, posture),
    )
