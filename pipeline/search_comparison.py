"""Searches of one call side by side: error against runs (dilorenzo2009 Fig. 6.8)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.call_fit import CallTask, search
from pipeline.laugh_fit import LaughFit
from pipeline.settings import FollowSettings
from pipeline.torso_runs import TorsoRuns

Floats = NDArray[np.float64]

WORDS = {"crs2": "controlled random search (global)", "direct": "DIRECT (global)"}


def compare_searches(
    fit: LaughFit, runs: TorsoRuns, settings: FollowSettings, seed: int
) -> dict[str, Floats]:
    """Errors of the loudest call in the order of evaluation, by the name of the search.

    The default starts from what the call before found and from linear steps; the compared ones
    from the middle of the bounds, at the same tonic level, as if nothing were known.
    """
    if not settings.compared:
        return {}
    loud = max(fit.calls, key=lambda one: float(one.pressure.max()))
    middle = loud.space.values(np.full(len(loud.fit.values), 0.5))
    traces = {f"call {loud.number}, as fitted": loud.fit.trace}
    for algorithm in settings.compared:
        task = CallTask(
            runs=runs, moment=loud.started, score=loud.before, space=loud.space,
            pressure=loud.pressure,
        )  # fmt: skip
        plain = replace(settings, n_starts=1, goal=0.0, first_step=0.25)
        search(task, middle, loud.fit.tonic, plain, settings.compared_evaluations, algorithm, seed)
        name = WORDS.get(algorithm, f"{algorithm.replace('_', ' ')} (local)")
        traces[name] = np.array(task.trace)
    return traces
