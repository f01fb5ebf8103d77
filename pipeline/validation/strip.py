"""A value drawn on its band: a small figure a row of the table."""

from __future__ import annotations

import math

from markupsafe import Markup

WIDTH, HEIGHT = 150.0, 18.0
LEFT, RIGHT = 50.0, 100.0
"""Where a band with two limits begins and ends."""
EDGE = 7.0
"""Nearest that a mark comes to the end of the strip."""


def place(low: float, high: float, value: float) -> float:
    """Where a value stands on the strip; what is far outside stands at its end.

    Parameters
    ----------
    low, high : limits; one may be not a number, then the size of the other is the scale
    """
    if math.isnan(low):
        at = LEFT + (RIGHT - LEFT) * value / high
    elif math.isnan(high):
        at = LEFT * value / low
    else:
        at = LEFT + (RIGHT - LEFT) * (value - low) / (high - low)
    return min(max(at, EDGE), WIDTH - EDGE)


def _mark(at: float, side: str) -> str:
    middle = HEIGHT / 2.0
    if side == "":
        return f'<circle class="mark-in" cx="{at:.1f}" cy="{middle}" r="4.5"/>'
    tip = at - 6.0 if side == "low" else at + 6.0
    back = at + 5.0 if side == "low" else at - 5.0
    points = f"{tip:.1f},{middle} {back:.1f},{middle - 6} {back:.1f},{middle + 6}"
    return f'<polygon class="mark-out" points="{points}"/>'


def strip(low: float, high: float, value: float, side: str) -> Markup:
    """SVG of a band and a value on it: a dot inside, an arrow that points away outside.

    Parameters
    ----------
    side : "low", "high" or "" as `table.compare` says; an infinite value stands at the end
    """
    start = 0.0 if math.isnan(low) else LEFT
    end = WIDTH if math.isnan(high) else RIGHT
    at = place(low, high, value)
    told = {"": "inside", "low": "below", "high": "above"}[side]
    return Markup(
        f'<svg class="strip" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}" role="img"'
        f' aria-label="{told} the band"><line class="axis" x1="0" x2="{WIDTH:.0f}"'
        f' y1="{HEIGHT / 2}" y2="{HEIGHT / 2}"/><rect class="band" x="{start}" y="3"'
        f' width="{end - start}" height="{HEIGHT - 6}"/>{_mark(at, side)}</svg>'
    )
