"""One place through which the validation asks the torso to do something."""

from __future__ import annotations

from dataclasses import dataclass

from sim.behaviour import run_controls
from sim.control.library import find_controls
from sim.errors import ParameterError
from sim.motion import Motion
from sim.resting import RestingTorso
from sim.simulate import Trajectory


@dataclass(frozen=True, kw_only=True, slots=True)
class Run:
    """A behaviour as it was simulated.

    Parameters
    ----------
    posture : "upright" or "supine"
    rate : breaths, or whole events, a second
    rest : the torso at rest in the same posture, one frame
    """

    posture: str
    rate: float
    trajectory: Trajectory
    motion: Motion
    rest: Motion


def run_behaviour(name: str, resting: RestingTorso, posture: str) -> Run:
    """Simulate a behaviour's calibrated form for its own duration, from rest.

    Raises
    ------
    ParameterError
        if there is no such behaviour
    """
    controls = find_controls(name)
    duration = controls.run_duration
    if duration is None:
        raise ParameterError(f"{controls.place}: says no duration_s. Add it.")
    done = run_controls(resting, controls, posture=posture, duration=duration)
    return Run(
        posture=posture,
        rate=1.0 / done.cycle,
        trajectory=done.trajectory,
        motion=done.motion,
        rest=done.rest,
    )
