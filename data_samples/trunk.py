"""The resting trunk of a subject: heights, horizontal sections, points on the skin.

Body axes: X anterior, Y left, Z up, metres; Z is the height above the floor, X = 0 the most
posterior point of the back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from data_samples.parameters import MarkerPlace, Parameters

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class Trunk:
    """Heights (m) and the curves half breadth, depth and back line against height."""

    heights: dict[str, float]
    half_breadth: PchipInterpolator
    depth: PchipInterpolator
    back: PchipInterpolator
    exponent: float

    def point(self, azimuth: Floats, height: Floats) -> Floats:
        """Skin at an azimuth (rad, 0 front, + left) and a height (m): (..., 3) m."""
        power = 2.0 / self.exponent
        cosine, sine = np.cos(azimuth), np.sin(azimuth)
        depth = self.depth(height)
        front = np.sign(cosine) * np.abs(cosine) ** power
        side = np.sign(sine) * np.abs(sine) ** power
        x = self.back(height) + 0.5 * depth * (1.0 + front)
        y = self.half_breadth(height) * side
        return np.stack([x, y, np.broadcast_to(height, x.shape)], axis=-1)


def _regression(p: Parameters, name: str) -> float:
    return (
        p(f"{name}_constant")
        + p(f"{name}_per_stature") * p("stature")
        + p(f"{name}_per_mass") * p("mass")
    )


def trunk_heights(p: Parameters) -> dict[str, float]:
    """Heights of the named levels (m), standing."""
    taller = p("stature") - p("mean_stature")
    heights = {
        name: p(f"{name}_height") + p(f"{name}_height_per_stature") * taller
        for name in ("notch", "navel", "tenth")
    }
    sternum = p("sternum_length") * p("stature") / p("mean_stature")
    heights["xiphoid"] = heights["notch"] - sternum * np.cos(p("sternum_slope"))
    heights["c7"] = p("c7_height_per_stature") * p("stature")
    heights["bottom"] = heights["navel"] - p("trunk_bottom_drop")
    return heights


def build_trunk(p: Parameters) -> Trunk:
    """Trunk of a subject's sex, stature and mass."""
    z = trunk_heights(p)
    bust = z["notch"] + p("bust_fraction") * (z["xiphoid"] - z["notch"])
    chest_depth, waist_depth = _regression(p, "chest_depth"), _regression(p, "waist_depth")
    chest_breadth = _regression(p, "chest_breadth")
    levels = [z["bottom"], z["navel"], bust, z["notch"], z["c7"]]
    depth_notch = p("notch_depth_ratio") * chest_depth
    breadths = [
        _regression(p, "bicristal_breadth"),
        _regression(p, "waist_breadth"),
        chest_breadth,
        p("notch_breadth_ratio") * chest_breadth,
        p("notch_breadth_ratio") * chest_breadth,
    ]
    apex = z["c7"] + p("back_apex_fraction") * (z["navel"] - z["c7"])
    return Trunk(
        heights=z,
        half_breadth=PchipInterpolator(levels, 0.5 * np.array(breadths)),
        depth=PchipInterpolator(
            levels, [waist_depth, waist_depth, chest_depth, depth_notch, depth_notch]
        ),
        back=PchipInterpolator(
            [z["bottom"], z["navel"], apex, z["c7"]],
            [p("back_offset_lumbar"), p("back_offset_lumbar"), 0.0, p("back_offset_c7")],
        ),
        exponent=p("section_exponent"),
    )


def place_markers(trunk: Trunk, places: tuple[MarkerPlace, ...]) -> tuple[Floats, Floats]:
    """Resting marker positions (n, 3) m and their azimuths (n,) rad."""
    azimuth = np.array([place.azimuth for place in places])
    height = np.array(
        [
            trunk.heights[place.start]
            + place.fraction * (trunk.heights[place.stop] - trunk.heights[place.start])
            for place in places
        ]
    )
    return trunk.point(azimuth, height), azimuth
