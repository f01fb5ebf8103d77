"""Figures of the comparison of the muscle laws (dilorenzo2009, Figs. 4.2 to 4.7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from pipeline.draw.figure import ACCENT, FAINT, MEASURED, SIMULATED, as_svg, panels
from sim.muscle_experiments import Convergence, HillCurves
from sim.muscle_rig import Motion

LINES = {
    "spring": ("spring", ACCENT, (0, (4, 2))),
    "hill": ("Hill, as printed", SIMULATED, "-"),
    "hill_lengthening": ("Hill, stronger when stretched", MEASURED, (0, (1, 1.5))),
}
"""Name, colour and dash of a law; the thesis has the spring dashed too."""
MS = 1e3


def motion_svg(motions: Mapping[str, Motion], *, marks: Mapping[float, str], span: float) -> str:
    """Tension and place of the particle against time, one line a law.

    Parameters
    ----------
    motions : by law
    marks : what happens at a time, s
    span : time to show, s
    """
    figure, axes = panels(2, 1, width=6.2, height=4.6, share_x=True)
    for law, motion in motions.items():
        name, colour, dash = LINES[law]
        axes[0].plot(motion.time, motion.tension, color=colour, ls=dash, label=name)
        axes[1].plot(motion.time, -motion.place, color=colour, ls=dash)
    for axis in axes:
        for time in marks:
            axis.axvline(time, color=FAINT, lw=0.8, zorder=0)
    axes[1].axhline(0.0, color=FAINT, lw=0.8, zorder=0)
    axes[1].annotate(
        "frozen particle", (span, 0.0), xytext=(-2, 3), textcoords="offset points",
        ha="right", fontsize=7,
    )  # fmt: skip
    for time, word in marks.items():
        axes[0].annotate(
            word, (time, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -2),
            textcoords="offset points", va="top", fontsize=7,
        )  # fmt: skip
    axes[0].set_ylabel("tension, N")
    axes[0].legend(fontsize=8, loc="upper right", bbox_to_anchor=(1.0, 1.0))
    axes[1].set_ylabel("height of the particle, m")
    axes[1].set_xlabel("time, s")
    axes[1].set_xlim(0.0, span)
    return as_svg(figure)


def _muscle(axis: Axes, at: float, height: float, law: str) -> None:
    _, colour, dash = LINES[law]
    axis.plot([at, at], [0.0, height], color=colour, ls=dash, lw=1.2)
    axis.plot(at, 0.0, "s", color=MEASURED, ms=4)
    axis.plot(at, height, "o", color=colour, ms=6)


def filmstrip_svg(motions: Mapping[str, Motion], times: Sequence[float], *, since: float) -> str:
    """Both muscles side by side in a few frames, the frozen particle on top.

    Parameters
    ----------
    motions : "spring" and "hill"
    times : of the frames, s
    since : what the frames' times are counted from, s
    """
    figure, axes = panels(1, len(times), width=6.2, height=2.6)
    heights = {law: np.interp(times, m.time, -m.place) for law, m in motions.items()}
    low = min(h.min() for h in heights.values())
    high = max(0.0, *(h.max() for h in heights.values()))
    for k, axis in enumerate(axes):
        for i, law in enumerate(motions):
            _muscle(axis, float(i), float(heights[law][k]), law)
        axis.axhline(0.0, color=FAINT, lw=0.8, zorder=0)
        axis.set_xlim(-0.7, 1.7)
        axis.set_ylim(low - 0.1, high + 0.1)
        axis.set_xticks([0, 1], ["S", "H"], fontsize=7)
        axis.set_title(f"{MS * (times[k] - since):.0f} ms", fontsize=7, loc="center")
        if k:
            axis.set_yticks([])
            axis.spines["left"].set_visible(False)
    axes[0].set_ylabel("height, m")
    figure.supxlabel("S spring, H Hill; the square is the frozen particle", fontsize=8)
    return as_svg(figure)


def curves_svg(curves: HillCurves) -> str:
    """Force against length and against speed, as in Fig. 4.2, with what belongs to them."""
    figure, axes = panels(1, 2, width=6.2, height=2.8)
    axes[0].plot(curves.ratio, curves.active, color=SIMULATED, label="active, over F_max")
    axes[0].plot(curves.ratio, curves.passive, color=ACCENT, ls="--", label="passive, over k_PE")
    axes[0].set_xlabel("length over rest length")
    axes[0].set_ylabel("force, dimensionless")
    axes[0].set_ylim(-0.05, 1.6)
    axes[0].legend(fontsize=7, loc="upper left")
    axes[0].set_title("(a) force and length")
    axes[1].plot(curves.rate, curves.printed, color=SIMULATED, label="as printed")
    axes[1].plot(
        curves.rate, curves.lengthening, color=MEASURED, ls=LINES["hill_lengthening"][2],
        label="calibrated",
    )  # fmt: skip
    axes[1].axvline(0.0, color=FAINT, lw=0.8, zorder=0)
    axes[1].axhline(1.0, color=FAINT, lw=0.8, zorder=0)
    axes[1].set_xlabel("speed over v_max, positive lengthening")
    axes[1].set_ylabel("force over isometric")
    axes[1].set_ylim(-0.05, 1.6)
    axes[1].legend(fontsize=7, loc="upper left")
    axes[1].set_title("(b) force and speed")
    return as_svg(figure)


def convergence_svg(lines: Sequence[Convergence]) -> str:
    """Error of the place against the step, both axes logarithmic, one panel a law."""
    laws = list(dict.fromkeys(line.law for line in lines))
    figure, axes = panels(1, len(laws), width=6.2, height=2.8)
    for axis, law in zip(axes, laws, strict=True):
        for line, (colour, mark) in zip(
            (c for c in lines if c.law == law), ((SIMULATED, "o-"), (ACCENT, "s--")), strict=True
        ):
            label = f"{line.scheme}: order {line.order:.2f}"
            axis.loglog(MS * line.step, 100.0 * line.error, mark, color=colour, ms=4, label=label)
        axis.set_xlabel("step, ms")
        axis.set_title(LINES[law][0])
        axis.legend(fontsize=7, loc="lower right")
        axis.set_xticks([0.125, 0.25, 0.5, 1, 2, 4], ["0.125", "0.25", "0.5", "1", "2", "4"])
        axis.minorticks_off()
    top = max(100.0 * line.error.max() for line in lines)
    least = min(100.0 * line.error.min() for line in lines)
    for axis in axes:
        axis.set_ylim(0.6 * least, 1.6 * top)
        axis.set_yticks([0.03, 0.1, 0.3, 1, 3], ["0.03", "0.1", "0.3", "1", "3"])
    axes[0].set_ylabel("largest error of the place,\n% of the rest length")
    return as_svg(figure)
