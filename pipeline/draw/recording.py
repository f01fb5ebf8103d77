"""Figures of a recording: what was read, its breaths, the mean breath."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pipeline.draw.figure import (
    ACCENT,
    FAINT,
    LABEL_NEAR,
    MEASURED,
    SIMULATED,
    as_svg,
    label_points,
    panels,
)

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

MM = 1e3
N_STRIPES = 300
N_CURVE = 3000
MAX_SHOWN = 9


def marker_names(names: Sequence[str], labels: Sequence[str]) -> list[str]:
    """Return the canonical name of each marker, its label where it has none."""
    return [name or label for name, label in zip(names, labels, strict=True)]


def input_svg(
    *,
    positions: Floats,
    measured: Bools,
    rate: float,
    start: float,
    shown: Sequence[str],
    front: Sequence[int],
    back: Sequence[int],
) -> str:
    """Mean place of each marker from the right and from the front, and when it was seen.

    Parameters
    ----------
    positions : (n_frames, n_markers, 3), m
    measured : (n_frames, n_markers)
    rate, start : Hz, s
    shown : name of each marker
    front, back : markers of the midline in front, and those that give the trunk's motion
    """
    figure, axes = panels(1, 3, width=9.0, height=max(3.2, 1.2 + 0.13 * len(shown)))
    place = MM * np.nanmean(positions, axis=0)
    roles = {"other": [], "on the back": list(back), "front midline": list(front)}
    taken = {*front, *back}
    roles["other"] = [i for i in range(len(shown)) if i not in taken]
    colours = {"other": FAINT, "on the back": ACCENT, "front midline": SIMULATED}
    for axis, across, title in (
        (axes[0], 0, "from the right, facing right"),
        (axes[1], 1, "from the front"),
    ):
        for role, chosen in roles.items():
            if chosen:
                spots = place[chosen]
                axis.scatter(spots[:, across], spots[:, 2], s=16, c=colours[role], label=role)
        label_points(axis, place[:, [across, 2]], shown, near=LABEL_NEAR, offset=(3, 2))
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_title(title)
        axis.set_xlabel("mm")
    axes[0].set_ylabel("mm, up")
    axes[0].legend(fontsize=6)
    _stripes(axes[2], measured, rate, start, shown)
    return as_svg(figure)


def _stripes(axis: Axes, measured: Bools, rate: float, start: float, shown: Sequence[str]) -> None:
    parts = np.array_split(measured, min(N_STRIPES, len(measured)))
    share = np.stack([part.mean(axis=0) for part in parts])
    edges = start + np.linspace(0, len(measured) / rate, len(parts) + 1)
    for row in range(len(shown)):
        gaps = np.flatnonzero(share[:, row] < 1)
        axis.plot(edges[[0, -1]], [row, row], color=FAINT, lw=3, solid_capstyle="butt")
        for gap in gaps:
            depth = float(share[gap, row])
            axis.plot(edges[gap : gap + 2], [row, row], color=SIMULATED, lw=3, alpha=1 - depth)
    axis.set_yticks(range(len(shown)), shown, fontsize=6)
    axis.invert_yaxis()
    axis.set_title("seen (grey) and missing (orange)")
    axis.set_xlabel("s")


def cycles_svg(
    *,
    signal: Floats,
    rate: float,
    start: float,
    onset: Floats,
    peak: Floats,
    used: Bools,
) -> str:
    """Breathing signal with the onset and the peak of every breath.

    Parameters
    ----------
    signal : (n_frames,), m, up on inspiration
    rate, start : Hz, s of the first frame
    onset, peak : (n_cycles,), s
    used : (n_cycles,)
    """
    figure, axes = panels(1, 1, width=9.0, height=2.6)
    time = start + np.arange(len(signal)) / rate
    step = max(1, len(signal) // N_CURVE)
    axes[0].plot(time[::step], MM * signal[::step], color=MEASURED, lw=0.9)
    for events, symbol, name in ((onset, "o", "onset"), (peak, "^", "peak")):
        level = MM * np.interp(events, time, signal)
        for chosen, colour, word in ((used, ACCENT, ""), (~used, SIMULATED, ", not used")):
            if chosen.any():
                axes[0].plot(
                    events[chosen],
                    level[chosen],
                    symbol,
                    color=colour,
                    ms=4,
                    label=f"{name}{word}",
                )
    axes[0].set_xlabel("s")
    axes[0].set_ylabel("breathing signal (mm)")
    axes[0].legend(fontsize=7, ncols=4, loc="upper right", bbox_to_anchor=(1, 1.18))
    return as_svg(figure)


def most_moving(mean: Floats, first: Sequence[int]) -> list[int]:
    """Return markers to show: `first` (the front midline), then those that move most.

    Parameters
    ----------
    mean : (n_phase, n_markers, 3), m
    """
    travel = np.linalg.norm(np.ptp(mean, axis=0), axis=1)
    order = [*first, *(int(i) for i in np.argsort(-travel, kind="stable") if i not in set(first))]
    return order[:MAX_SHOWN]


def signature_svg(
    *,
    time: Floats,
    mean: Floats,
    low: Floats,
    high: Floats,
    turn: float,
    shown: Sequence[str],
    front: Sequence[int],
) -> str:
    """Forward, left and upward motion of the markers that matter over the mean breath.

    Parameters
    ----------
    time : (n_phase,), s
    mean, low, high : (n_phase, n_markers, 3), m, band of the cycles
    turn : s, end of the inspiration
    shown : name of each marker
    front : markers of the midline in front
    """
    chosen = most_moving(mean, front)
    n_columns = 3
    n_rows = -(-len(chosen) // n_columns)
    figure, axes = panels(n_rows, n_columns, width=9.0, height=1.9 * n_rows + 0.4, share_x=True)
    rest = mean[:1]
    words = (("forward", SIMULATED), ("left", FAINT), ("up", ACCENT))
    for axis, marker in zip(axes, chosen, strict=False):
        for k, (word, colour) in enumerate(words):
            bottom, top = (MM * (edge - rest)[:, marker, k] for edge in (low, high))
            axis.fill_between(time, bottom, top, color=colour, alpha=0.2, lw=0)
            axis.plot(time, MM * (mean - rest)[:, marker, k], color=colour, label=word)
        axis.axvline(turn, color=FAINT, lw=0.7)
        axis.set_title(shown[marker])
    for axis in axes[len(chosen) :]:
        axis.set_axis_off()
    axes[0].legend(fontsize=7)
    axes[0].set_ylabel("mm")
    figure.supxlabel("s from the onset; the line is the end of the inspiration", fontsize=8)
    return as_svg(figure, timed=axes[: len(chosen)])
