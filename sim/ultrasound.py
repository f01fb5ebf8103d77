"""The dome as M-mode ultrasound sees it: along a beam that stands still, not at a point of tissue.

The probe lies under the costal margin, between the midclavicular and the anterior axillary line,
and looks medially, cranially and dorsally at the posterior third of one half of the diaphragm;
the excursion is how far the echo moves along that line (Boussuges 2009, in physiology.csv through
the review Boussuges 2020). Where the dome falls and tilts, the echo moves further than the tissue.
"""

from __future__ import annotations

import numpy as np

from sim.model.mesh import ray_depths
from sim.motion import Motion
from sim.physics.types import Floats, Ints

DOME_HEIGHT = 0.03
"""m; what lies this near below the highest point of the diaphragm at rest is its dome."""
SIDES = {"right": ("RCOS", -1.0), "left": ("LCOS", 1.0)}
"""Marker on the costal margin where the probe lies; sign of Y of that half."""


def is_dome(rest: Motion) -> Floats:
    """(n_vertices,), whether a vertex of the diaphragm belongs to the dome."""
    height = rest.soft["diaphragm"].vertices[0, :, 2]
    return np.asarray(height > height.max() - DOME_HEIGHT)


def echo_depth(vertices: Floats, faces: Ints, probe: Floats, toward: Floats) -> Floats:
    """How far from a probe each beam leaves a surface for the last time, (n_beams,) m.

    Parameters
    ----------
    vertices, faces : of the surface, (n, 3) m, (m, 3)
    probe : (3,), m
    toward : (n_beams, 3), what the beams aim at, m

    Returns
    -------
    not a number where a beam misses the surface
    """
    ways = toward - probe
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    last = [ray_depths(vertices[faces], probe, way).max(initial=-np.inf) for way in ways]
    return np.where(np.isfinite(last), last, np.nan)


def dome_excursion(motion: Motion, rest: Motion, start: int, end: int) -> dict[str, float]:
    """How far the echo of the dome comes towards the probe between two frames, m, right and left.

    The mean over beams from where the probe lies at `start` to every vertex of the dome in the
    posterior third of its half; not a number where no beam meets the diaphragm at both times.
    """
    soft = motion.soft["diaphragm"]
    dome, then, now = is_dome(rest), soft.vertices[start], soft.vertices[end]
    back = then[dome, 0].min() + np.ptp(then[dome, 0]) / 3.0
    out = {}
    for side, (marker, sign) in SIDES.items():
        probe = motion.markers[start, motion.marker_names.index(marker)]
        aim = then[dome & (sign * then[:, 1] > 0.0) & (then[:, 0] <= back)]
        way = echo_depth(then, soft.faces, probe, aim) - echo_depth(now, soft.faces, probe, aim)
        out[side] = float(np.nanmean(way)) if np.isfinite(way).any() else np.nan
    return out
