"""Figure of a posterior: each level and each pair of levels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.draw.figure import ACCENT, SIMULATED, as_svg, panels

Floats = NDArray[np.float64]

N_DOTS = 400
N_BINS = 40
SHOWN_PERCENT = 99.5


def posterior_svg(*, draws: Floats, best: Floats, groups: Sequence[str]) -> str:
    """Histogram of each level and scatter of each pair.

    Parameters
    ----------
    draws : (n_draws, n_groups)
    best : (n_groups,), levels of the fit
    groups : names
    """
    n = len(groups)
    figure, axes = panels(n, n, width=7.0, height=6.6)
    some = draws[:: max(1, len(draws) // N_DOTS)]
    edge = np.maximum(np.percentile(draws, SHOWN_PERCENT, axis=0), best) * 1.05 + 1e-3
    names = [group.replace("_", " ") for group in groups]
    for row in range(n):
        for column in range(n):
            axis = axes[row * n + column]
            if column > row:
                axis.set_axis_off()
            elif column == row:
                axis.hist(draws[:, row], bins=N_BINS, range=(0, edge[row]), color=ACCENT, alpha=0.7)
                axis.axvline(best[row], color=SIMULATED, lw=1.0)
                axis.set_yticks([])
            else:
                axis.plot(some[:, column], some[:, row], ".", ms=2, alpha=0.35, color=ACCENT)
                axis.plot(best[column], best[row], "+", ms=7, color=SIMULATED)
            axis.set_xlim(0, edge[column])
            if column < row:
                axis.set_ylim(0, edge[row])
            axis.tick_params(labelsize=6)
            if row == n - 1:
                axis.set_xlabel(names[column], fontsize=7)
            if column == 0:
                axis.set_ylabel(names[row], fontsize=7)
    return as_svg(figure)
