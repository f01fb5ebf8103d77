"""A breath in by external intercostals and diaphragm, to a lung volume that is asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.call_effort import ABDOMEN, INTERCOSTALS
from pipeline.score import FLEXION, Score, numbers
from pipeline.torso_runs import TorsoRuns
from sim.errors import UnstableSimulation
from sim.simulate import Moment, Trajectory

Steps = tuple[tuple[float, float], ...]
INSPIRATORY = "external_intercostals"
FIRST_LEVELS = (0.0, 0.15, 0.4, 0.85)
ROUND = (-0.06, -0.02, 0.02, 0.06)
"""Levels of the first round of runs, and those of the second about what the first points to."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Breath:
    """A gap between bouts as the torso passes it.

    Parameters
    ----------
    span : start and end of the breath in, s; nothing where none was made
    level : of the external intercostals
    volume, wanted : m^3, at the end of the gap
    evaluations : runs
    score, moment, trajectory : the score with the breath, the moment at its end, and the run
    """

    span: tuple[float, float] | None
    level: float
    volume: float
    wanted: float
    evaluations: int
    score: Score
    moment: Moment
    trajectory: Trajectory


def breathing(
    score: Score,
    gap: tuple[float, float],
    breath: tuple[float, float] | None,
    level: float,
    *,
    motion: bool,
    steps: Steps = (),
) -> Score:
    """The score with effort that ends at the start of a gap and a breath in within it.

    Parameters
    ----------
    gap, breath : start and end, s
    level : of the external intercostals; the diaphragm has its share
    steps : shares of the breath's time and level between which it rises; else one rise
    """
    of = numbers()
    a, b = breath or gap
    calm = max(gap[0] + 0.3 * of["rest_time"], min(gap[0] + of["rest_time"], a))
    for muscle in (ABDOMEN, INTERCOSTALS):
        score = score.line(muscle, (gap[0], score.level(muscle)), (calm, 0.0))
    shares = {INSPIRATORY: 1.0, "diaphragm": of["diaphragm_per_intercostals"]}
    for muscle, share in shares.items():
        start = max(a, gap[0])
        score = score.line(muscle, (start, score.level(muscle)))
        for part, height in steps or ((of["rise_share"], 1.0),):
            score = score.line(muscle, (start + part * (b - start), height * share * level))
        score = score.line(muscle, (gap[1], share * level))
    score = score.line(INSPIRATORY, (gap[1] + of["let_go_time"], 0.0))
    if motion:
        score = score.line(FLEXION, (gap[0], score.level(FLEXION)))
        score = score.line(FLEXION, (b, of["extension"] if breath else 0.0))
        raised = of["shoulders_in"] if breath else 0.0
        score = score.line("shoulder_elevators", (a, 0.0), (b, raised))
        score = score.line("shoulder_elevators", (gap[1] + of["let_go_time"], 0.0))
    return score


def breathe_in(
    runs: TorsoRuns,
    moment: Moment,
    score: Score,
    gap: tuple[float, float],
    breath: tuple[float, float] | None,
    wanted: float,
    *,
    motion: bool,
    steps: Steps = (),
) -> Breath:
    """Find the level of a breath by its volume; without one the gap passes by itself.

    Parameters
    ----------
    gap, breath : start and end, s
    wanted : lung volume at the end of the gap, m^3
    steps : as in `breathing`
    """

    def told(level: float) -> Score:
        return breathing(score, gap, breath, level, motion=motion, steps=steps)

    tried: list[float] = []
    volumes: list[float] = []

    def volume_at(levels: tuple[float, ...]) -> None:
        scores = [told(one) for one in levels]
        for level, run in zip(levels, runs.each(moment, scores, *gap), strict=True):
            if run is not None:
                tried.append(level)
                volumes.append(float(run[0].lung[-1]))

    volume_at((0.0,) if breath is None else FIRST_LEVELS)
    if breath is not None and len(tried) > 1:
        order = np.argsort(tried)
        rising = np.maximum.accumulate(np.array(volumes)[order])
        guess = float(np.interp(wanted, rising, np.array(tried)[order]))
        volume_at(tuple(sorted({float(np.clip(guess + d, 0.0, 0.9)) for d in ROUND})))
    if not tried:
        raise UnstableSimulation(
            f"the torso cannot pass the gap at {gap[0]:.2f} s. Lower pressure.intensity."
        )
    level = tried[int(np.argmin(np.abs(np.array(volumes) - wanted)))]
    trajectory, after = runs.run(moment, told(level), *gap)
    return Breath(
        span=breath if level > 0.0 else None,
        level=level,
        volume=float(trajectory.lung[-1]),
        wanted=wanted,
        evaluations=len(tried) + 1,
        score=told(level),
        moment=after,
        trajectory=trajectory,
    )
