"""Run what a control file says and take its figures."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sim.control.controls import Controls
from sim.events import event_figures
from sim.motion import Motion, motion, rest_motion
from sim.resting import RestingTorso
from sim.simulate import Trajectory, simulate
from sim.summary import summarise


@dataclass(frozen=True, kw_only=True, slots=True)
class Behaviour:
    """A control file as it was simulated.

    Parameters
    ----------
    cycle : s, length of a breath or of the whole event
    step : s
    trajectory, motion : the run
    rest : the torso at rest in the same posture, one frame
    closed : s, longest closure of the larynx
    realtime_factor : simulated over elapsed time of the step loop
    """

    posture: str
    cycle: float
    step: float
    trajectory: Trajectory
    motion: Motion
    rest: Motion
    closed: float
    realtime_factor: float

    def figures(self) -> dict[str, Any]:
        """Figures of the last breath and of the whole run."""
        found = summarise(self.motion, self.rest, rate=1.0 / self.cycle)
        return found | event_figures(self.trajectory, self.motion, self.rest, closed=self.closed)


def run_controls(
    resting: RestingTorso,
    controls: Controls,
    *,
    posture: str,
    duration: float,
    step: float | None = None,
    tension: bool = False,
    dump: Path | None = None,
) -> Behaviour:
    """Simulate a control file from rest.

    Parameters
    ----------
    duration : s
    step : s, at most; the file and the parameter set may ask for less
    tension : keep the tension of every element
    dump : file for the state just before a divergence
    """
    numbers = resting.torso.parameters
    finest = min(controls.run_step, numbers["longest_step"], step or np.inf)
    drive = controls.at_step(finest).drive(duration, numbers)
    rest = rest_motion(resting, posture)
    start = time.perf_counter()
    trajectory = simulate(
        resting, drive.activation, posture=posture, step=finest, rate=controls.run_frames,
        tension=tension, larynx=drive.larynx, bend=drive.bend, dump=dump,
    )  # fmt: skip
    taken = time.perf_counter() - start
    return Behaviour(
        posture=posture,
        cycle=controls.run_cycle(duration),
        step=finest,
        trajectory=trajectory,
        motion=motion(resting, trajectory, posture=posture),
        rest=rest,
        closed=controls.closed_time(duration),
        realtime_factor=duration / taken,
    )
