"""Steps towards a call's pressure that take it as proportional to each change of activation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from pipeline.call_effort import AMPLITUDES
from pipeline.score import numbers
from pipeline.torso_runs import Run

if TYPE_CHECKING:
    from pipeline.call_fit import CallTask

Floats = NDArray[np.float64]

NUDGES = np.array([0.04, 0.02, 0.02, 0.02])
"""Changes of the three amplitudes and of the tonic level that show what each does."""
TIMING_NUDGE = 0.05
"""The same for start and frequency, of their range."""
REACH = (-4.0, 8.0)
"""Least and most nudges of one linear step."""
SHARES = (1.0, 0.5)
"""Of the linear step that are tried: pressure is not quite in proportion."""
RIDGE = 0.02
"""How dear a change is: a nudge's worth, beside the pressure that is missing as a whole."""

Tried = tuple[Floats, float]
Move = Callable[[float], Tried]


def linear_steps(
    task: CallTask, guesses: Sequence[Floats], tonic: float, steps: int
) -> tuple[Floats, float]:
    """The best guess, bettered as if pressure answered in proportion; and the tonic level.

    Parameters
    ----------
    guesses : seven parameters each
    tonic : level of the abdomen's tonic effort at the call's start
    steps : the first moves amplitudes and tonic level, later ones also the times
    """
    at, run = _best_of(task, [(guess, tonic) for guess in guesses])
    for number in range(steps):
        if run is None:
            break
        better, after = _linear_step(task, at, run, timing=number > 0)
        if task.cost(after) >= task.cost(run):
            break
        at, run = better, after
    return at


def _best_of(task: CallTask, tried: Sequence[Tried]) -> tuple[Tried, Run | None]:
    runs = task.run(tried)
    best = int(np.argmin([task.cost(run) for run in runs]))
    return tried[best], runs[best]


def _linear_step(task: CallTask, at: Tried, run: Run, *, timing: bool) -> tuple[Tried, Run | None]:
    """Move each number a little, then all together by what least squares say of the answers."""
    moves = _moves(task, *at, timing=timing)
    answers = task.run([move(1.0) for move in moves])
    good = [
        (move, task.answer(answer) - task.answer(run))
        for move, answer in zip(moves, answers, strict=True)
        if answer is not None
    ]
    if not good:
        return at, None
    rows = np.array([answer for _, answer in good])
    dear = RIDGE * float(np.linalg.norm(task.pressure)) * np.eye(len(good))
    missing = np.concatenate([task.pressure - task.answer(run), np.zeros(len(good))])
    amount = lsq_linear(np.vstack([rows.T, dear]), missing, bounds=REACH).x
    tried = []
    for share in SHARES:
        values, tonic = at
        for (move, _), many in zip(good, amount, strict=True):
            moved, level = move(share * float(many))
            values, tonic = values + moved - at[0], tonic + level - at[1]
        inside = task.space.values(task.space.unit(values))
        tried.append((inside, float(np.clip(tonic, 0.0, numbers()["most_tonic"]))))
    return _best_of(task, tried)


def _moves(task: CallTask, values: Floats, level: float, *, timing: bool) -> list[Move]:
    """Changes of one number each; the argument says how many nudges."""
    low, high = task.space.bounds

    def change(k: int, size: float) -> Move:
        def move(many: float) -> Tried:
            out = values.copy()
            out[k] += many * size
            return out, level

        return move

    def up(many: float) -> Tried:
        return values, level + many * float(NUDGES[3])

    moves = [change(k, float(size)) for k, size in zip(AMPLITUDES, NUDGES[:3], strict=True)]
    if timing:
        moves += [change(k, TIMING_NUDGE * float(high[k] - low[k])) for k in (2, 3, 5, 6)]
    return [*moves, up]
