"""Shape of the diaphragm as it is built: zone of apposition, dome, edge of the central tendon."""

from __future__ import annotations

import numpy as np

from sim.model.anatomy import Anatomy
from sim.model.mesh import along, ray_depths
from sim.physics.types import Floats
from sim.tables import Parameters, column


def _radius(faces: Floats, angle: float, z: float, axis: float) -> float:
    """Distance from the vertical axis at which a ray meets the sheet."""
    way = np.array([np.cos(angle), np.sin(angle), 0.0])
    return float(ray_depths(faces, np.array([axis, 0.0, z]), way).min(initial=np.inf))


def apposed_heights(parameters: Parameters) -> Floats:
    """Height of the zone of apposition at rest in the reference man, (n,) m, rim back to front."""
    return column(parameters.rows("apposition.csv"), "height_mm") * 1e-3


def apposed_path(faces: Floats, rim: Floats, height: float, parameters: Parameters) -> Floats:
    """Points up the rib cage's sheet from a rim point, a little inside it, (n, 3) m.

    Parameters
    ----------
    faces : (n_faces, 3, 3), triangles of the sheet, m
    rim : (3,), m
    height : of the zone of apposition above the rim point, m
    """
    axis = parameters["torso_axis"]
    angle = np.arctan2(rim[1], rim[0] - axis)
    path = [rim]
    for z in np.linspace(0.0, height, 7)[1:]:
        radius = _radius(faces, angle, rim[2] + z, axis)
        if not np.isfinite(radius):
            break
        radius -= parameters["contact_gap"]
        path.append(np.array([axis + radius * np.cos(angle), radius * np.sin(angle), rim[2] + z]))
    return np.array(path)


def fibre_path(path: Floats, edge: Floats, rows: int) -> Floats:
    """Points from the rim over the apposed path and an arc to the tendon's edge, (rows + 2, 3) m.

    Parameters
    ----------
    path : (n, 3), of `apposed_path`
    edge : (3,), end on the central tendon, m
    rows : free points between the two ends
    """
    start = path[-1]
    rise = max(0.6 * (edge[2] - start[2]), 0.01)
    run = edge - start
    run[2] = 0.0
    c1 = start + np.array([0.0, 0.0, rise])
    c2 = edge - 0.45 * run
    t = np.linspace(0.0, 1.0, 30)[1:, None]
    arc = (1 - t) ** 3 * start + 3 * (1 - t) ** 2 * t * c1 + 3 * (1 - t) * t**2 * c2 + t**3 * edge
    return along(np.vstack([path, arc]), np.linspace(0.0, 1.0, rows + 2))


def tendon_edge(anatomy: Anatomy, parameters: Parameters, toward: Floats) -> Floats:
    """Edge of the central tendon, an ellipse: the points, (n, 3) m, that look at given ones.

    Fibres run radially, seen from above, so that a strip is as wide as what it must hold.

    Parameters
    ----------
    toward : (n, 3), where the fibres come from, m
    """
    middle = parameters["tendon_x"] * anatomy.scale[0]
    a = parameters["tendon_depth"] * anatomy.scale[0]
    b = parameters["tendon_breadth"] * anatomy.scale[1]
    level = anatomy.spine["T9"][2] + parameters["dome_above_t9"] * anatomy.scale[2]
    angle = np.arctan2(toward[:, 1] / b, (toward[:, 0] - middle) / a)
    x, y = middle + a * np.cos(angle), b * np.sin(angle)
    return np.stack([x, y, np.full(len(toward), level)], axis=1)
