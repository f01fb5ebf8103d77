"""Figures of a fit: the torso's markers beside the measured ones, and how the search went."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.draw.figure import (
    ACCENT,
    FAINT,
    GROUP_COLOURS,
    LABEL_NEAR,
    MEASURED,
    SIMULATED,
    as_svg,
    label_points,
    panels,
)
from pipeline.draw.recording import MM, most_moving

Floats = NDArray[np.float64]

# A breath moves markers by millimetres on a torso of half a metre; paths are drawn larger.
PATH_LENGTH_SHARE = 0.06
LITRES = 1e3


def sagittal_svg(
    *, measured: Floats, simulated: Floats, shown: Sequence[str], front: Sequence[int]
) -> str:
    """Paths of all markers seen from the right, enlarged about their mean places.

    Parameters
    ----------
    measured, simulated : (n_frames, n_markers, 3), m, over one breath in the same axes
    shown : name of each marker
    front : markers of the midline in front, drawn strongly
    """
    figure, axes = panels(1, 1, width=6.2, height=6.2)
    axis = axes[0]
    place = measured.mean(axis=0)
    moved = [x - x.mean(axis=0) for x in (measured, simulated)]
    span = float(np.ptp(place[:, 2])) or 1.0
    largest = max(float(np.abs(m).max()) for m in moved) or 1.0
    factor = max(1, round(PATH_LENGTH_SHARE * span / largest))
    strong = set(front) or set(range(len(shown)))
    for marker in range(len(shown)):
        alpha = 1.0 if marker in strong else 0.45
        for motion, colour in zip(moved, (MEASURED, SIMULATED), strict=True):
            path = MM * (place[marker] + factor * motion[:, marker])
            path = np.vstack([path, path[:1]])
            axis.plot(path[:, 0], path[:, 2], color=colour, alpha=alpha, lw=1.2)
            axis.plot(path[0, 0], path[0, 2], ".", color=colour, alpha=alpha, ms=4)
    label_points(axis, MM * place[:, [0, 2]], shown, near=LABEL_NEAR, offset=(6, -8))
    axis.plot([], [], color=MEASURED, label="measured")
    axis.plot([], [], color=SIMULATED, label="simulated")
    axis.legend(fontsize=8)
    axis.set_aspect("equal", adjustable="datalim")
    size = "in true size" if factor == 1 else f"{factor} times as large"
    axis.set_title(f"from the right, facing right; motion drawn {size}")
    axis.set_xlabel("mm, forward")
    axis.set_ylabel("mm, up")
    return as_svg(figure)


def markers_time_svg(
    *,
    time: Floats,
    measured: Floats,
    low: Floats,
    high: Floats,
    simulated: Floats,
    shown: Sequence[str],
    front: Sequence[int],
) -> str:
    """Forward and upward motion over one breath, measured with its band, and simulated.

    Parameters
    ----------
    time : (n_frames,), s
    measured, low, high, simulated : (n_frames, n_markers, 3), m
    shown : name of each marker
    front : markers of the midline in front, shown first
    """
    chosen = most_moving(measured, front)
    n_columns = 3
    n_rows = -(-len(chosen) // n_columns)
    figure, axes = panels(n_rows, n_columns, width=9.0, height=1.9 * n_rows + 0.5, share_x=True)
    middle, own = measured.mean(axis=0), simulated.mean(axis=0)
    for axis, marker in zip(axes, chosen, strict=False):
        for k, dashes in ((0, "-"), (2, (0, (4, 2)))):
            bottom, top = (MM * (edge - middle)[:, marker, k] for edge in (low, high))
            axis.fill_between(time, bottom, top, color=MEASURED, alpha=0.12, lw=0)
            for lines, mean, colour in ((measured, middle, MEASURED), (simulated, own, SIMULATED)):
                axis.plot(time, MM * (lines - mean)[:, marker, k], color=colour, ls=dashes)
        axis.set_title(shown[marker])
    for axis in axes[len(chosen) :]:
        axis.set_axis_off()
    for colour, dashes, text in (
        (MEASURED, "-", "measured, forward"),
        (MEASURED, (0, (4, 2)), "measured, up"),
        (SIMULATED, "-", "simulated, forward"),
        (SIMULATED, (0, (4, 2)), "simulated, up"),
    ):
        axes[0].plot([], [], color=colour, ls=dashes, label=text)
    figure.legend(
        *axes[0].get_legend_handles_labels(), fontsize=7, ncols=4, loc="outside upper left"
    )
    axes[0].set_ylabel("mm")
    figure.supxlabel("s from the onset", fontsize=8)
    return as_svg(figure, timed=axes[: len(chosen)])


def trace_svg(*, cost: Floats, still: float, levels: Floats, groups: Sequence[str]) -> str:
    """Cost and levels of every run in the order of the search.

    Parameters
    ----------
    cost : (n,), m, not-a-number for a failed run
    still : m, cost of not moving
    levels : (n, 4)
    groups : names of the four
    """
    figure, axes = panels(2, 1, width=9.0, height=4.2, share_x=True)
    run = np.arange(1, len(cost) + 1)
    best = np.fmin.accumulate(np.where(np.isfinite(cost), cost, np.inf))
    axes[0].plot(run, MM * cost, ".", color=FAINT, ms=4, label="one run")
    axes[0].plot(run, MM * best, color=ACCENT, label="best so far", drawstyle="steps-post")
    if np.isfinite(still):
        axes[0].axhline(MM * still, color=SIMULATED, lw=0.9, ls="--", label="not moving")
    axes[0].set_ylabel("cost (mm)")
    axes[0].set_ylim(bottom=0)
    axes[0].legend(fontsize=7, ncols=3)
    for k, group in enumerate(groups):
        name = group.replace("_", " ")
        axes[1].plot(run, levels[:, k], ".", ms=3, color=GROUP_COLOURS[k], label=name)
    axes[1].set_ylabel("level")
    axes[1].set_xlabel("run of the torso")
    axes[1].legend(fontsize=7, ncols=4)
    return as_svg(figure)


def volume_svg(*, time: Floats, volume: Floats, turn: float) -> str:
    """Lung volume over one breath.

    Parameters
    ----------
    time : (n_frames,), s
    volume : (n_frames,), m3
    turn : s, end of the inspiration
    """
    figure, axes = panels(1, 1, width=6.0, height=2.6)
    litres = LITRES * volume
    axes[0].plot(time, litres, color=ACCENT)
    axes[0].axvline(turn, color=FAINT, lw=0.7)
    axes[0].set_title(f"{np.ptp(litres):.2f} L in one breath")
    axes[0].set_ylabel("lung volume (L)")
    axes[0].set_xlabel("s from the onset; the line is the end of the inspiration")
    return as_svg(figure, timed=axes)


def ribs_svg(*, time: Floats, pump: Floats, bucket: Floats, ribs: Sequence[str]) -> str:
    """Rotation of each rib about its pump-handle and bucket-handle axes over one breath.

    Parameters
    ----------
    time : (n_frames,), s
    pump, bucket : (n_frames, n_ribs), degrees from rest
    ribs : name of each rib
    """
    figure, axes = panels(1, 2, width=9.0, height=3.0, share_x=True)
    for axis, angle, title in ((axes[0], pump, "pump handle"), (axes[1], bucket, "bucket handle")):
        for k, rib in enumerate(ribs):
            shade = 0.25 + 0.75 * k / max(1, len(ribs) - 1)
            axis.plot(time, angle[:, k], color=ACCENT, alpha=shade, lw=1.0, label=rib)
        axis.set_title(title)
        axis.set_xlabel("s from the onset")
    axes[0].set_ylabel("degrees from rest")
    axes[1].legend(fontsize=6, ncols=2, title="rib", title_fontsize=6)
    return as_svg(figure, timed=axes)
