"""Figures of a sound that the torso follows: pressure, volume, effort; and the search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pipeline.draw.figure import (
    ACCENT,
    FAINT,
    GROUP_COLOURS,
    MEASURED,
    SIMULATED,
    as_svg,
    panels,
)

Floats = NDArray[np.float64]
PUBLISHED = ((400, 0.18, "simplex"), (1800, 0.16, "annealing"))
"""dilorenzo2009 Fig. 6.8, as its text gives it: runs, error, method."""


def followed_svg(
    *,
    time: Floats,
    desired: Floats,
    simulated: Floats,
    low: Floats,
    high: Floats,
    what: str,
    unit: str,
    volume: Floats,
    levels: Floats,
    groups: Sequence[str],
    larynx: Floats,
    spans: Sequence[tuple[float, float]],
    breaths: Sequence[tuple[float, float]],
    limits: tuple[float, float],
) -> str:
    """Desired against simulated, lung volume, activations and larynx over time.

    Parameters
    ----------
    time : (n,), s; desired, simulated, low, high : (n,), in `unit`; what : their name
    volume : (n,), L over rest; levels : (n, n_groups); larynx : (n,), cmH2O s/L, infinite if closed
    spans : calls or events; breaths : breaths in, s
    limits : s, of the axis
    """
    figure, (top, lung, effort, throat) = panels(4, 1, width=9.0, height=8.4, share_x=True)
    top.fill_between(time, low, high, color=FAINT, alpha=0.4, lw=0, label="interval of desired")
    top.plot(time, desired, color=MEASURED, label="desired, from the sound", lw=1.2)
    top.plot(time, simulated, color=SIMULATED, label="simulated", lw=1.2)
    reach = 1.15 * max(float(np.max(desired)), float(np.max(simulated)), 1e-9)
    top.set_ylim(min(float(np.min(simulated)), 0.0) - 0.05 * reach, reach)
    top.set_title(f"{what}, desired and simulated (dilorenzo2009 Fig. 6.9)")
    top.set_ylabel(unit)
    top.legend(fontsize=6, loc="upper right", ncols=3)
    lung.axhline(0.0, color=FAINT, lw=0.8)
    lung.plot(time, volume, color=ACCENT)
    lung.set_title("lung volume over rest")
    lung.set_ylabel("L")
    for level, name, colour in zip(levels.T, groups, GROUP_COLOURS, strict=True):
        effort.plot(time, level, color=colour, label=name.replace("_", " "), lw=1.1)
    effort.set_title("activations")
    effort.legend(fontsize=6, loc="upper right", ncols=4)
    effort.set_ylim(0.0, max(0.05, 1.25 * float(levels.max())))
    _throat(throat, time, larynx)
    for axis in (top, lung, effort, throat):
        _shade(axis, spans, breaths)
    throat.set_xlabel("s")
    throat.set_xlim(*limits)
    return as_svg(figure, timed=(top, lung, effort, throat))


def _throat(axis: Axes, time: Floats, larynx: Floats) -> None:
    closed = ~np.isfinite(larynx)
    axis.plot(time, np.where(closed, np.nan, larynx), color=MEASURED, lw=1.0)
    if closed.any():
        axis.fill_between(
            time, 0, 1, where=closed, transform=axis.get_xaxis_transform(), color=FAINT, alpha=0.6,
            lw=0, label="closed",
        )  # fmt: skip
        axis.legend(fontsize=6, loc="upper right")
    axis.set_title("larynx, on top of the open airway")
    axis.set_ylabel("cmH2O s/L")


def _shade(
    axis: Axes, spans: Sequence[tuple[float, float]], breaths: Sequence[tuple[float, float]]
) -> None:
    for k, (start, end) in enumerate(spans):
        axis.axvspan(start, end, color=ACCENT, alpha=0.10 if k % 2 else 0.05, lw=0)
    for start, end in breaths:
        axis.axvspan(start, end, color="#6a4fa3", alpha=0.10, lw=0)


def search_svg(*, traces: Mapping[str, Floats]) -> str:
    """Least error so far against runs of the torso, for one call (dilorenzo2009 Fig. 6.8).

    Parameters
    ----------
    traces : (n,) normalised errors in order of evaluation, by the name of the search
    """
    figure, (axis,) = panels(1, 1, width=9.0, height=3.0)
    for (name, trace), colour in zip(traces.items(), GROUP_COLOURS, strict=False):
        best = np.minimum.accumulate(np.minimum(trace, 2.0))
        axis.step(np.arange(1, len(best) + 1), best, where="post", color=colour, label=name)
    for runs, error, method in PUBLISHED:
        axis.plot([runs], [error], marker="x", color=MEASURED, ls="", ms=6)
        axis.annotate(
            f"published, {method}", (runs, error), xytext=(-4, 5), textcoords="offset points",
            fontsize=6, ha="right",
        )  # fmt: skip
    axis.axhline(0.16, color=FAINT, lw=0.8, ls="--")
    axis.set_xscale("log")
    axis.set_ylim(0.0, 1.05)
    axis.set_xlabel("runs of the torso")
    axis.set_ylabel("RMS over that of no pressure")
    axis.set_title("error of one call against runs")
    axis.legend(fontsize=6, loc="upper right")
    return as_svg(figure)
