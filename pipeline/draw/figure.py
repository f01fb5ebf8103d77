"""What every figure shares: size, colours, and how it becomes text."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

LABEL_NEAR = 12.0
"""mm; markers nearer than this in a drawing share a label."""
MEASURED, SIMULATED, ACCENT, FAINT = "#1d2226", "#c4571f", "#0b6a74", "#b9bec2"
GROUP_COLOURS = ("#0b6a74", "#c4571f", "#6a4fa3", "#5a8f29")

POINTS = 72.0
"""Of a drawing, an inch."""

STYLE: Any = {
    "svg.fonttype": "none",
    # Ids depend on the drawing alone, so that the same result gives the same file.
    "svg.hashsalt": "pleura",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "path.simplify_threshold": 0.5,
}
mpl.rcParams.update(STYLE)


def panels(
    rows: int, columns: int, *, width: float, height: float, share_x: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return a figure, width and height in inches, and its axes row by row."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=share_x)
    return figure, list(axes.flat)


def label_points(
    axis: Axes,
    spots: NDArray[np.float64],
    texts: Sequence[str],
    *,
    near: float,
    offset: tuple[float, float],
) -> None:
    """Name the points; points that lie together, as left and right from the side, share a label.

    Parameters
    ----------
    spots : (n, 2), in the units of the axes; near : in the same; offset : points
    """
    shared: list[tuple[NDArray[np.float64], list[str]]] = []
    for spot, text in zip(spots, texts, strict=True):
        beside = [names for at, names in shared if np.linalg.norm(at - spot) < near]
        if beside:
            beside[0].append(text)
        else:
            shared.append((spot, [text]))
    for at, names in shared:
        axis.annotate(
            ", ".join(names),
            (float(at[0]), float(at[1])),
            xytext=offset,
            textcoords="offset points",
            fontsize=6,
        )


def as_svg(figure: Figure, *, timed: Sequence[Axes] = ()) -> str:
    """Return the figure as SVG, the same text for the same drawing.

    Parameters
    ----------
    timed : axes with seconds from the onset along them: `data-time-axes` tells left, top, width
        and height of each in the drawing, and its first and last second
    """
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue()
    if not timed:
        return text
    wide, tall = (POINTS * inches for inches in figure.get_size_inches())
    boxes = []
    for axis in timed:
        place, span = axis.get_position(), axis.get_xlim()
        corner = (wide * place.x0, tall * (1.0 - place.y1), wide * place.width, tall * place.height)
        boxes.append([round(float(v), 3) for v in (*corner, *span)])
    return text.replace("<svg ", f'<svg data-time-axes="{json.dumps(boxes)}" ', 1)
