"""Small side views of the torso in a row, as SVG: one scale for all, millimetres in the file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from pipeline.draw.figure import FAINT, MEASURED, SIMULATED
from pipeline.draw.section import Floats

LUNG, BELLY, BONE, BONE_EDGE, SOFT = "#d3e3ee", "#f4e6d4", "#e9e4d8", "#8d8677", "#5c666e"
MM = 1e3
MARGIN, GAP, HEAD = 12.0, 18.0, 64.0
"""mm around the torso, between panels, and above them for two lines of text."""
TEXT = 21.0
BAR = 100.0
"""mm, length of the scale bar."""
FOOT = 44.0
"""mm below a panel, for the scale bar and its words."""
LEAST_COLUMNS = 4
"""A strip of few panels is drawn as wide as one of so many, so that scales stay comparable."""


@dataclass(frozen=True, kw_only=True, slots=True)
class View:
    """Lines and areas of one frame, (n, 2) each: forwards and up, m.

    Parameters
    ----------
    skin : front and back at the midline
    chest, abdomen, diaphragm : cut through the top of the right dome
    ribs : centrelines of the right ribs
    cartilages : from the ribs' ends to the sternum
    sternum, vertebrae : midline areas
    processes : spinous processes
    pelvis : its rim
    """

    skin: list[Floats]
    chest: list[Floats]
    abdomen: list[Floats]
    diaphragm: list[Floats]
    ribs: list[Floats]
    cartilages: list[Floats]
    sternum: Floats
    vertebrae: list[Floats]
    processes: list[Floats]
    pelvis: Floats


@dataclass(frozen=True, kw_only=True, slots=True)
class Panel:
    """One picture of a strip.

    Parameters
    ----------
    view : what is drawn
    title, line : two short lines above it
    """

    view: View
    title: str
    line: str


def _path(lines: Sequence[Floats], style: str, *, close: bool = False) -> str:
    """One path of many lines; y grows downwards in SVG."""
    parts = []
    for line in lines:
        x, y = MM * line[:, 0], 0.0 - MM * line[:, 1]
        points = " ".join(f"{a:.0f},{b:.0f}" for a, b in zip(x, y, strict=True))
        parts.append(f"M{points}{'Z' if close else ''}")
    return f'<path d="{"".join(parts)}" {style}/>' if parts else ""


def _line(colour: str, width: float, dash: str = "") -> str:
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    return (
        f'fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"'
        f' stroke-linecap="round"{dashes}'
    )


def _torso(view: View, still: View | None) -> str:
    """Belly and lung first, then bones, then the lines that matter."""
    edge = f'stroke="{BONE_EDGE}" stroke-width="1.2"'
    drawn = [
        _path(view.abdomen, f'fill="{BELLY}"', close=True),
        _path(view.chest, f'fill="{LUNG}"', close=True),
        _path(view.processes, _line(BONE_EDGE, 2.0)),
        _path(view.vertebrae, f'fill="{BONE}" {edge}', close=True),
        _path([view.pelvis], _line(BONE_EDGE, 2.5)),
        _path(view.ribs, _line(BONE_EDGE, 6.0)),
        _path(view.ribs, _line(BONE, 3.8)),
        _path(view.cartilages, _line(BONE_EDGE, 2.0, "4 5")),
        _path([view.sternum], f'fill="{BONE}" {edge}', close=True),
    ]
    if still is not None:
        drawn.append(_path(still.skin, _line(SOFT, 1.5, "6 6")))
        drawn.append(_path(still.diaphragm, _line(SOFT, 2.5, "6 6")))
    drawn.append(_path(view.skin, _line(MEASURED, 2.5)))
    drawn.append(_path(view.diaphragm, _line(SIMULATED, 5.0)))
    return "".join(drawn)


def _extent(panels: Sequence[Panel], still: View | None) -> tuple[Floats, Floats]:
    shown = [panel.view for panel in panels] + ([still] if still is not None else [])
    points = [line for view in shown for line in (*view.skin, *view.ribs, *view.vertebrae)]
    every = MM * np.vstack([*points, *(view.pelvis for view in shown)])
    return every.min(axis=0) - MARGIN, every.max(axis=0) + MARGIN


def _words(x: float, y: float, text: str, extra: str = "") -> str:
    return f'<text x="{x:.0f}" y="{y:.0f}" {extra}>{escape(text)}</text>'


def filmstrip_svg(panels: Sequence[Panel], *, still: View | None = None, columns: int = 6) -> str:
    """Panels side by side, facing right.

    Parameters
    ----------
    still : the torso at rest, drawn dashed behind every panel
    columns : panels in a row
    """
    low, high = _extent(panels, still)
    wide, tall = (float(v) for v in high - low)
    step, row = wide + GAP, tall + HEAD + FOOT
    n_columns = min(columns, len(panels))
    n_rows = -(-len(panels) // n_columns)
    out = []
    for k, panel in enumerate(panels):
        left, top = (k % n_columns) * step, (k // n_columns) * row
        out.append(_words(left + MARGIN, top + TEXT, panel.title, 'font-weight="600"'))
        out.append(_words(left + MARGIN, top + 2.25 * TEXT, panel.line, f'fill="{SOFT}"'))
        out.append(
            f'<g transform="translate({left - low[0]:.0f} {top + HEAD + high[1]:.0f})">'
            f"{_torso(panel.view, still)}</g>"
        )
        if k == 0:
            y = top + HEAD + tall + 8.0
            out.append(
                f'<path d="M{left + MARGIN:.0f},{y:.0f}h{BAR:.0f}" stroke="{MEASURED}"'
                f' stroke-width="4"/>{_words(left + MARGIN, y + TEXT + 4.0, "100 mm")}'
            )
        if k % n_columns:
            out.append(
                f'<path d="M{left - GAP / 2:.0f},{top + HEAD:.0f}v{tall:.0f}" stroke="{FAINT}"/>'
            )
    width, height = max(n_columns, LEAST_COLUMNS) * step - GAP, n_rows * row
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}"'
        f' width="{width:.0f}" height="{height:.0f}" font-family="DejaVu Sans, sans-serif"'
        f' font-size="{TEXT:.0f}" role="img">{"".join(out)}</svg>'
    )
