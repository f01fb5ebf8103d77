"""Runs of one torso from a moment on, several at a time."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.score import Score
from sim.errors import ControlFileError, UnstableSimulation
from sim.resting import RestingTorso
from sim.simulate import Moment, Trajectory, go_on, rest_moment

Floats = NDArray[np.float64]
Run = tuple[Trajectory, Moment]


@dataclass(frozen=True, kw_only=True, slots=True)
class TorsoRuns:
    """A torso that can be run from any moment.

    Parameters
    ----------
    resting : at rest
    posture : "upright" or "supine"
    step : s
    lung : "two_way" or "one_way"
    workers : threads; they change the speed, never a number
    """

    resting: RestingTorso
    posture: str
    step: float
    lung: str
    workers: int

    @property
    def rest(self) -> Moment:
        """The torso at rest."""
        return rest_moment(self.resting, self.posture)

    def grid(self, time: float) -> float:
        """The nearest time at which a step ends, s."""
        return round(time / self.step) * self.step

    def run(self, moment: Moment, score: Score, start: float, end: float) -> Run:
        """Run a score from `start` to `end`, s, with every step kept.

        Raises
        ------
        UnstableSimulation, ControlFileError
            if the torso cannot do it
        """
        controls = score.between(start, end).controls(step=self.step)
        parameters = self.resting.torso.parameters
        drive = controls.drive(end - start, parameters, start=start)
        return go_on(
            self.resting, moment, drive.activation, step=self.step, rate=1.0 / self.step,
            larynx=drive.larynx, bend=drive.bend, lung=self.lung,
        )  # fmt: skip

    def each(
        self, moment: Moment, scores: Sequence[Score], start: float, end: float
    ) -> list[Run | None]:
        """Run many scores from the same moment; nothing for one that the torso cannot do."""

        def one(score: Score) -> Run | None:
            try:
                return self.run(moment, score, start, end)
            except (UnstableSimulation, ControlFileError):
                return None

        if len(scores) == 1 or self.workers == 1:
            return [one(score) for score in scores]
        with ThreadPoolExecutor(max_workers=self.workers) as pool:
            return list(pool.map(one, scores))
