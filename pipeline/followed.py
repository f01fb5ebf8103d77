"""A sound as the torso followed it: what was asked, what it did, played once from rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.score import LARYNX, Score
from pipeline.torso_runs import TorsoRuns
from sim.control.controls import Controls
from sim.control.curves import add_up
from sim.motion import Motion, motion
from sim.simulate import LEVELS, go_on

Floats = NDArray[np.float64]
TABLE_RATE = 250.0
"""Samples a second that are kept."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Followed:
    """Time courses of the whole, in the file's time.

    Parameters
    ----------
    time : (n,), s
    desired : (n,), what the torso was asked for, in SI units, and `quantity` what that is:
        "pressure" in the lung (Pa) or "flow" out of it (m^3/s)
    low, high : (n,), interval of it, or copies of it where none is known
    asked : (n,) of bool, where it counts
    pressure, pleural, abdominal : (n,), Pa; flow : (n,), m^3/s; lung : (n,), m^3, all simulated
    levels : (n, 4), activation of `sim.simulate.LEVELS`
    larynx : (n,), cmH2O s/L; infinite where closed
    rest : resting lung volume, m^3
    start, end : s, span of the control file in the file's time
    """

    time: Floats
    desired: Floats
    low: Floats
    high: Floats
    asked: NDArray[np.bool_]
    quantity: str
    pressure: Floats
    pleural: Floats
    abdominal: Floats
    flow: Floats
    lung: Floats
    levels: Floats
    larynx: Floats
    rest: float
    start: float
    end: float

    @property
    def simulated(self) -> Floats:
        """What stands against `desired`."""
        return self.pressure if self.quantity == "pressure" else self.flow

    def correlation(self) -> float:
        """Pearson's r of desired and simulated where it counts; not a number without both."""
        a, b = self.desired[self.asked], self.simulated[self.asked]
        if len(a) < 2 or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
            return float("nan")
        return float(np.corrcoef(a, b)[0, 1])


def play(runs: TorsoRuns, score: Score, end: float) -> dict[str, Floats]:
    """Play a whole score from rest; time courses by name, `TABLE_RATE` samples a second."""
    run, _ = runs.run(runs.rest, score, 0.0, end)
    every = slice(None, None, max(1, round(1.0 / (TABLE_RATE * runs.step))))
    time = run.time[every]
    levels = [add_up(score.curves(name), time) for name in LEVELS]
    larynx = add_up(score.curves(LARYNX), time)
    for start, stop in score.closed:
        larynx[(time >= start) & (time < stop)] = np.inf
    return {
        "time": time,
        "pressure": run.alveolar[every],
        "pleural": run.pleural[every],
        "abdominal": run.abdominal[every],
        "flow": run.flow[every],
        "lung": run.lung[every],
        "levels": np.stack(levels, axis=1),
        "larynx": larynx,
    }


def in_space(runs: TorsoRuns, controls: Controls, end: float) -> Motion:
    """The torso's motion from a control file, as `pleura simulate` makes it.

    Parameters
    ----------
    controls : says frames a second
    end : s
    """
    drive = controls.drive(end, runs.resting.torso.parameters)
    trajectory, _ = go_on(
        runs.resting, runs.rest, drive.activation, step=runs.step, rate=controls.run_frames,
        tension=True, larynx=drive.larynx, bend=drive.bend, lung=runs.lung,
    )  # fmt: skip
    return motion(runs.resting, trajectory, posture=runs.posture)
