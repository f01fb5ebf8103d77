"""Whether points lie inside a surface."""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.types import Floats, Ints


@compiled
def turns(points: Floats, vertices: Floats, faces: Ints) -> Floats:
    """Winding number (k,) of a surface about points: near one inside, near nothing outside.

    Parameters
    ----------
    points : (k, 3), m; vertices : (n, 3), m; faces : (m, 3), outward

    References
    ----------
    Van Oosterom and Strackee 1983, the solid angle of a triangle
    """
    out = np.empty(len(points))
    for k in range(len(points)):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        total = 0.0
        for f in range(len(faces)):
            i, j, m = faces[f, 0], faces[f, 1], faces[f, 2]
            ax, ay, az = vertices[i, 0] - x, vertices[i, 1] - y, vertices[i, 2] - z
            bx, by, bz = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
            cx, cy, cz = vertices[m, 0] - x, vertices[m, 1] - y, vertices[m, 2] - z
            la = np.sqrt(ax * ax + ay * ay + az * az)
            lb = np.sqrt(bx * bx + by * by + bz * bz)
            lc = np.sqrt(cx * cx + cy * cy + cz * cz)
            volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            flat = la * lb * lc + (ax * bx + ay * by + az * bz) * lc
            flat += (bx * cx + by * cy + bz * cz) * la + (cx * ax + cy * ay + cz * az) * lb
            total += np.arctan2(volume, flat)
        out[k] = total / (2.0 * np.pi)
    return out
