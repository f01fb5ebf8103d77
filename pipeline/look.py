"""How things look outside the page as in it: light of a colour, opacity, colour of a tension."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SEE_THROUGH = {"skin": 0.35, "chest_cavity": 0.25, "abdomen": 0.35}
"""Opacity, in a file for another tool, of what would hide the rest."""
RAMP = ("#a79fc4", "#8f0da4", "#cc4778", "#f2844b", "#fdca26")
"""Colours of a muscle from no tension to the largest of the run, as in `viewer/src/figure.js`."""
FIBRE = (0.0022, 0.0058)
"""m, width of a muscle's element without tension and with the largest one, as there."""
MARKER = 0.005
"""m, radius of a marker, as there."""
SIMULATED = "#e0702a"
"""Colour of a simulated marker, as there."""


def srgb(colour: str) -> Floats:
    """Colour `#rrggbb` as three numbers from 0 to 1."""
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0


def linear(colour: str) -> list[float]:
    """Colour of a page (sRGB) as light."""
    light = srgb(colour)
    curved = ((light + 0.055) / 1.055) ** 2.4
    return [round(float(v), 4) for v in np.where(light <= 0.04045, light / 12.92, curved)]


def levels(tension: Floats, most: float) -> Floats:
    """Root of a tension over the largest, from 0 to 1: weak muscles are seen beside strong ones."""
    return np.asarray(np.sqrt(np.clip(tension / max(most, 1e-9), 0.0, 1.0)))


def ramp(level: Floats) -> Floats:
    """Light (..., 3) of levels from 0 to 1."""
    colours = np.array([linear(colour) for colour in RAMP])
    places = np.linspace(0.0, 1.0, len(RAMP))
    return np.stack([np.interp(level, places, colours[:, c]) for c in range(3)], axis=-1)


def fibre_width(level: Floats) -> Floats:
    """Width of an element of a level, m."""
    return np.asarray(FIBRE[0] + (FIBRE[1] - FIBRE[0]) * level)
