"""Figure of a breath retraining: lung volume over one breath of each step."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from pipeline.draw.figure import as_svg, panels

Floats = NDArray[np.float64]
COLOURS = "viridis"
LIGHTEST = 0.85
"""Of the colour map; the last of it is too pale on white."""


def steps_svg(*, curves: Sequence[tuple[Floats, Floats]]) -> str:
    """Lung volume over its least one, from the onset of the inspiration.

    Parameters
    ----------
    curves : time (n,), s, and volume (n,), L, of each step; the first is the person's own
    """
    figure, (axis,) = panels(1, 1, width=9.0, height=3.2)
    colours = mpl.colormaps[COLOURS](np.linspace(0.0, LIGHTEST, len(curves)))
    for number, ((time, volume), colour) in enumerate(zip(curves, colours, strict=True)):
        name = f"step {number}" if number else "own breath"
        axis.plot(time, volume - volume.min(), color=colour, label=name, ls="-" if number else "--")
    axis.set_ylabel("lung volume (L)")
    axis.set_xlabel("s from the onset of the inspiration")
    axis.set_xlim(0.0, max(float(time[-1]) for time, _ in curves))
    axis.legend(fontsize=7, loc="upper right")
    return as_svg(figure, timed=(axis,))
