"""Figures of the papers, drawn from our runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.patches import Circle, Rectangle

from pipeline.draw.figure import ACCENT, FAINT, MEASURED, SIMULATED, as_svg, panels
from pipeline.draw.section import Floats

Curve = Mapping[str, Floats]
"""Columns of a run's table by name."""
STYLE_LINES = {
    "calm": ("calm", MEASURED, "-"),
    "deep": ("slow and deep", ACCENT, "-"),
    "panting": ("panting", "#6a4fa3", (0, (4, 1.5))),
    "forced_exhale": ("forced exhale", SIMULATED, (0, (1, 1.2))),
}
PAIR_LINES = {
    "paradoxical_normal": ("without the belly", ACCENT, (0, (4, 2))),
    "paradoxical": ("belly contracts in inspiration", SIMULATED, "-"),
}
NORMS = (0.35, 0.5, 0.7)
"""L, quiet breathing: range and textbook mean, as in the physiology table."""
NORMAL_RATE = (13.0, 17.0)
"""Breaths a minute "in the average human" (dilorenzo2009 section 5.2)."""
MINUTE = 60.0


def volumes_svg(
    forms: Mapping[str, Mapping[str, Curve]], capacity: Mapping[str, float], span: float
) -> str:
    """Lung volume over time of the breath styles, a panel a form (Fig. 5.2).

    Parameters
    ----------
    forms : title to style to curve
    span : time to show, s
    """
    return _over_forms(forms, STYLE_LINES, capacity, span)


def pair_svg(
    forms: Mapping[str, Mapping[str, Curve]], capacity: Mapping[str, float], span: float
) -> str:
    """Lung volume of the paradoxical breath and its twin, a panel a form (Fig. 7.3)."""
    return _over_forms(forms, PAIR_LINES, {"frc": capacity["frc"]}, span)


def _over_forms(
    forms: Mapping[str, Mapping[str, Curve]],
    lines: Mapping[str, tuple[str, str, Any]],
    capacity: Mapping[str, float],
    span: float,
) -> str:
    figure, axes = panels(1, len(forms), width=8.6, height=3.6)
    for axis, (title, runs) in zip(axes, forms.items(), strict=True):
        for style, (label, colour, dash) in lines.items():
            if style in runs:
                time, volume = runs[style]["time_s"], runs[style]["lung_l"]
                axis.plot(time, volume, color=colour, ls=dash, label=label)
        for name, level in capacity.items():
            axis.axhline(level, color=FAINT, lw=0.7, zorder=0)
            axis.annotate(name.upper(), (span, level), xytext=(3, 0), fontsize=7, va="center",
                          textcoords="offset points", color="#5c666e",
                          annotation_clip=False)  # fmt: skip
        axis.set(title=title, xlabel="time (s)", xlim=(0.0, span))
    low = min(axis.get_ylim()[0] for axis in axes)
    high = max(axis.get_ylim()[1] for axis in axes)
    for axis in axes:
        axis.set_ylim(low, high)
    axes[0].set_ylabel("lung volume (L)")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8)
    return as_svg(figure)


def map_svg(contractions: Floats, periods: Floats, tidal: Floats, calm: tuple[float, float]) -> str:
    """Tidal volume as colour over contraction and period (Fig. 5.3).

    Parameters
    ----------
    contractions : (n,)
    periods : (m,), s
    tidal : (n, m), L
    calm : contraction and period of the calm behaviour
    """
    figure, (axis,) = panels(1, 1, width=7.0, height=4.6)
    shown = axis.pcolormesh(contractions, periods, tidal.T, shading="nearest", cmap="cividis")
    lines = axis.contour(contractions, periods, tidal.T, levels=NORMS, colors="white",
                         linewidths=(1.0, 1.8, 1.0))  # fmt: skip
    axis.clabel(lines, fmt="%.2g L", fontsize=8)
    slow, quick = (MINUTE / rate for rate in NORMAL_RATE)
    top = min(slow, float(periods[-1]))
    axis.add_patch(Rectangle((contractions[0], quick), float(np.ptp(contractions)), top - quick,
                             fill=False, ec="white", lw=1.0, ls=(0, (4, 3))))  # fmt: skip
    rates = "{:.0f} to {:.0f} a minute".format(*NORMAL_RATE)
    axis.annotate(rates, (float(contractions[-1]), quick), xytext=(-4, 3),
                  textcoords="offset points", ha="right", va="bottom", fontsize=8)  # fmt: skip
    axis.plot(*calm, "o", mfc="none", mec="white", ms=8, mew=1.8)
    axis.annotate("calm", calm, xytext=(8, -3), textcoords="offset points", color="white",
                  fontsize=8)  # fmt: skip
    bar = figure.colorbar(shown, ax=axis)
    bar.set_label("tidal volume (L)")
    for level in NORMS:
        bar.ax.axhline(level, color="white", lw=1.0)
    axis.set(xlabel="contraction: level of the external intercostals, the diaphragm in proportion",
             ylabel="period of a breath (s)")  # fmt: skip
    return as_svg(figure)


def ribs_svg(forms: Mapping[str, tuple[Floats, Floats, Floats]]) -> str:
    """Rotation of the right ribs over a breath, and how late each is, a column a form (Fig. 5.4).

    Parameters
    ----------
    forms : title to time (n,), s; turn (n, n_ribs), degrees; delay (n_ribs,), s
    """
    figure, axes = panels(2, len(forms), width=8.6, height=5.4)
    n = len(forms)
    for k, (title, (time, turn, late)) in enumerate(forms.items()):
        above, below = axes[k], axes[n + k]
        ribs = np.arange(1, turn.shape[1] + 1)
        colours = colormaps["viridis"](np.linspace(0.0, 0.9, len(ribs)))
        for colour, line in zip(colours, turn.T, strict=True):
            above.plot(time, line, color=colour, lw=1.2)
        above.set(title=title, xlabel="time from the onset of inspiration (s)",
                  xlim=(0.0, float(time[-1])))  # fmt: skip
        below.bar(ribs, 1e3 * late, color=colours)
        below.axhline(0.0, color=MEASURED, lw=0.7)
        below.set(
            xticks=ribs,
            xlabel="rib",
        )
    axes[0].set_ylabel("rotation, front end up (°)")
    axes[n].set_ylabel("later than rib 1 (ms)")
    return as_svg(figure)


def skin_svg(lines: Sequence[Mapping[str, Any]], gain: float) -> str:
    """Midline of the skin at moments of an inspiration (Fig. 5.5), as it is and exaggerated.

    Parameters
    ----------
    lines : `time_s`, `front`, `back` (n, 2) m, from the least to the largest volume
    gain : of the changes in the second panel
    """
    figure, axes = panels(1, 2, width=7.0, height=5.4)
    colours = colormaps["viridis"](np.linspace(0.0, 0.85, len(lines)))
    for axis, factor in zip(axes, (1.0, gain), strict=True):
        for line, colour in zip(lines, colours, strict=True):
            for part in ("front", "back"):
                first, now = np.array(lines[0][part]), np.array(line[part])
                shown = 1e3 * (first + factor * (now - first))
                label = f"{line['time_s']:.1f} s" if part == "front" else None
                axis.plot(*shown.T, color=colour, lw=1.1, label=label)
        axis.set_aspect("equal")
        axis.set(title="as it is" if factor == 1.0 else f"changes {gain:.0f} times as large",
                 xlabel="forwards (mm)")  # fmt: skip
    axes[0].set_ylabel("up (mm)")
    axes[0].legend(fontsize=8, loc="center", title="after full exhale", title_fontsize=8)
    return as_svg(figure)


def ball_svg(pictures: Mapping[str, Any], curves: Curve) -> str:
    """The ball on the belly of a lying torso, then dent and volume error over time (Fig. 3.6)."""
    frames = pictures["frames"]
    figure, axes = panels(2, len(frames), width=8.6, height=4.6)
    ball, wall = [np.array(f["ball_mm"]) for f in frames], [np.array(f["wall_mm"]) for f in frames]
    every, r = np.vstack(wall), float(pictures["radius_mm"])
    for axis, frame, at, line in zip(axes, frames, ball, wall, strict=False):
        axis.plot(*wall[0].T, color=FAINT, ls="--", lw=0.9)
        axis.plot(*line.T, color=SIMULATED)
        axis.add_patch(Circle((at[0], at[1]), r, color="#5c666e"))
        axis.set_aspect("equal")
        axis.set(title=f"{frame['title']}, {frame['time_s']:.2f} s", ylim=(
            every[:, 1].min() - 10, max(every[:, 1].max() + 160, 0)),
            xlim=(every[:, 0].min() - 10, every[:, 0].max() + 10))  # fmt: skip
        axis.tick_params(labelsize=7)
    axes[0].set_ylabel("up (mm)", fontsize=8)
    axes[0].set_xlabel("towards the head (mm)", fontsize=8)
    grid = axes[0].get_gridspec()
    if grid is not None:
        for axis in axes[len(frames) :]:
            axis.remove()
        half = len(frames) // 2
        left, right = figure.add_subplot(grid[1, :half]), figure.add_subplot(grid[1, half:])
        left.plot(curves["time_s"], curves["dent_mm"], color=SIMULATED)
        left.set(xlabel="time (s)", ylabel="deepest dent (mm)")
        right.plot(curves["time_s"], curves["volume_error_pct"], color=ACCENT)
        right.axhline(-0.5, color=FAINT, ls="--", lw=0.9)
        right.axhline(0.5, color=FAINT, ls="--", lw=0.9)
        right.set(xlabel="time (s)", ylabel="volume error (%)")
    return as_svg(figure)


def events_svg(runs: Mapping[str, Curve], pressure: str, label: str) -> str:
    """Lung volume above a pressure, a column a run.

    Parameters
    ----------
    pressure : column of the curves
    label : of its axis
    """
    figure, axes = panels(2, len(runs), width=8.6, height=4.0, share_x=False)
    n = len(runs)
    for k, (title, run) in enumerate(runs.items()):
        axes[k].plot(run["time_s"], run["lung_l"], color=MEASURED, lw=1.0)
        axes[k].set_title(title)
        axes[n + k].plot(run["time_s"], run[pressure], color=SIMULATED, lw=0.9)
        axes[n + k].set_xlabel("time (s)")
    for row in (axes[:n], axes[n:]):
        limits = np.array([axis.get_ylim() for axis in row])
        for axis in row:
            axis.set_ylim(limits[:, 0].min(), limits[:, 1].max())
    axes[0].set_ylabel("lung volume (L)")
    axes[n].set_ylabel(label)
    return as_svg(figure)
