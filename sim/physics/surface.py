"""Enclosed volume, its gradient and the weight of a fluid in a closed triangle mesh."""

from __future__ import annotations

from sim.physics.compiled import compiled
from sim.physics.types import Floats, Ints


@compiled
def enclosed_volume(x: Floats, faces: Ints) -> float:
    """Volume inside a closed mesh whose faces turn outwards.

    Parameters
    ----------
    x : (n_points, 3), m
    faces : (n_faces, 3), indices into `x`

    Returns
    -------
    m^3
    """
    total, first = 0.0, faces[0, 0]
    ox, oy, oz = x[first, 0], x[first, 1], x[first, 2]
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, az = x[i, 0] - ox, x[i, 1] - oy, x[i, 2] - oz
        bx, by, bz = x[j, 0] - ox, x[j, 1] - oy, x[j, 2] - oz
        cx, cy, cz = x[k, 0] - ox, x[k, 1] - oy, x[k, 2] - oz
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6.0


@compiled
def add_pressure(x: Floats, faces: Ints, pressure: float, gradient: Floats, out: Floats) -> None:
    """Add the nodal forces of a pressure that varies linearly in space.

    With a zero gradient and unit pressure this is the gradient of the enclosed volume, so
    the virtual work of a pressure is P dV to rounding. With the gradient `density * gravity`
    it is the weight of a fluid that fills the mesh.

    Parameters
    ----------
    x : (n_points, 3), m
    faces : (n_faces, 3), outward
    pressure : Pa at the origin
    gradient : (3,), Pa/m
    out : (n_points, 3), N, added to
    """
    gx, gy, gz = gradient[0], gradient[1], gradient[2]
    sloped = gx != 0.0 or gy != 0.0 or gz != 0.0
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ux, uy, uz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        wx, wy, wz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        if not sloped:
            s = pressure / 6.0
            for v in (i, j, k):
                out[v, 0] += s * nx
                out[v, 1] += s * ny
                out[v, 2] += s * nz
            continue
        pi = pressure + gx * x[i, 0] + gy * x[i, 1] + gz * x[i, 2]
        pj = pressure + gx * x[j, 0] + gy * x[j, 1] + gz * x[j, 2]
        pk = pressure + gx * x[k, 0] + gy * x[k, 1] + gz * x[k, 2]
        mean = pi + pj + pk
        for v, p in ((i, pi), (j, pj), (k, pk)):
            s = (mean + p) / 24.0
            out[v, 0] += s * nx
            out[v, 1] += s * ny
            out[v, 2] += s * nz
