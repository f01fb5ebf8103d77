"""One place through which the validation asks the torso to do something."""

from __future__ import annotations

from dataclasses import dataclass, replace

from sim.control.library import find_controls
from sim.motion import Motion, motion, rest_motion
from sim.resting import RestingTorso
from sim.simulate import Trajectory, simulate

STEP = 0.001
"""s, at most: at 2 ms a full supine inspiration of the man chatters."""


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
    controls = replace(controls, step=min(STEP, controls.run_step))
    duration = controls.run_duration or 0.0
    drive = controls.drive(duration, resting.torso.parameters)
    trajectory = simulate(
        resting, drive.activation, posture=posture, step=controls.run_step,
        rate=controls.run_frames, larynx=drive.larynx, bend=drive.bend,
    )  # fmt: skip
    return Run(
        posture=posture,
        rate=1.0 / controls.run_cycle(duration),
        trajectory=trajectory,
        motion=motion(resting, trajectory, posture=posture),
        rest=rest_motion(resting, posture),
    )
