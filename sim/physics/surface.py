"""Enclosed volume, its gradient and the weight of a fluid in a closed triangle mesh."""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import compiled, inner
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
    return volume_and_normals(x, faces, np.empty((faces.shape[0], 3)))


@compiled
def volume_and_normals(x: Floats, faces: Ints, normal: Floats) -> float:
    """Volume inside a closed mesh; the normals on the way are kept for `press`.

    Parameters
    ----------
    normal : (n_faces, 3), m^2, twice the area of each face along its normal, written

    Returns
    -------
    m^3
    """
    total, first = 0.0, faces[0, 0]
    ox, oy, oz = x[first, 0], x[first, 1], x[first, 2]
    for f in range(faces.shape[0]):
        i, j, k = np.uintp(faces[f, 0]), np.uintp(faces[f, 1]), np.uintp(faces[f, 2])
        ux, uy, uz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        wx, wy, wz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        total += (x[i, 0] - ox) * nx + (x[i, 1] - oy) * ny + (x[i, 2] - oz) * nz
        normal[f, 0], normal[f, 1], normal[f, 2] = nx, ny, nz
    return total / 6.0


@compiled
def press(
    x: Floats, faces: Ints, normal: Floats, pressure: float, gradient: Floats, out: Floats
) -> None:
    """Add the nodal forces of a pressure that varies linearly in space.

    With a zero gradient and unit pressure this is the gradient of the enclosed volume, so
    the virtual work of a pressure is P dV to rounding. With the gradient `density * gravity`
    it is the weight of a fluid that fills the mesh.

    Parameters
    ----------
    x : (n_points, 3), m
    faces : (n_faces, 3), outward
    normal : (n_faces, 3), of `volume_and_normals` at `x`
    pressure : Pa at the origin
    gradient : (3,), Pa/m
    out : (n_points, 3), N, added to
    """
    gx, gy, gz = gradient[0], gradient[1], gradient[2]
    if gx == 0.0 and gy == 0.0 and gz == 0.0:
        _press_evenly(faces, normal, pressure, out)
        return
    for f in range(faces.shape[0]):
        i, j, k = np.uintp(faces[f, 0]), np.uintp(faces[f, 1]), np.uintp(faces[f, 2])
        pi = pressure + gx * x[i, 0] + gy * x[i, 1] + gz * x[i, 2]
        pj = pressure + gx * x[j, 0] + gy * x[j, 1] + gz * x[j, 2]
        pk = pressure + gx * x[k, 0] + gy * x[k, 1] + gz * x[k, 2]
        mean = pi + pj + pk
        nx, ny, nz = normal[f, 0] / 24.0, normal[f, 1] / 24.0, normal[f, 2] / 24.0
        for v, p in ((i, mean + pi), (j, mean + pj), (k, mean + pk)):
            out[v, 0] += p * nx
            out[v, 1] += p * ny
            out[v, 2] += p * nz


@inner
def _press_evenly(faces: Ints, normal: Floats, pressure: float, out: Floats) -> None:
    s = pressure / 6.0
    for f in range(faces.shape[0]):
        nx, ny, nz = s * normal[f, 0], s * normal[f, 1], s * normal[f, 2]
        for v in (np.uintp(faces[f, 0]), np.uintp(faces[f, 1]), np.uintp(faces[f, 2])):
            out[v, 0] += nx
            out[v, 1] += ny
            out[v, 2] += nz


@compiled
def push(
    x: Floats, faces: Ints, normal: Floats, pressure: float, gradient: Floats, out: Floats
) -> None:
    """Add the nodal forces of a pressure that never pulls: max(0, P A / 3) n for each face.

    Parameters as in `press`; P is that of the middle of a face. Where a gradient leaves some
    faces without a force, what is left is no longer the gradient of a volume.

    References
    ----------
    dilorenzo2009, Eq. 3.3
    """
    for f in range(faces.shape[0]):
        i, j, k = np.uintp(faces[f, 0]), np.uintp(faces[f, 1]), np.uintp(faces[f, 2])
        here = pressure
        for c in range(3):
            here += gradient[c] * (x[i, c] + x[j, c] + x[k, c]) / 3.0
        s = max(0.0, here) / 6.0
        for v in (i, j, k):
            for c in range(3):
                out[v, c] += s * normal[f, c]


@compiled
def add_pressure(x: Floats, faces: Ints, pressure: float, gradient: Floats, out: Floats) -> None:
    """`press` on a mesh whose normals are not at hand."""
    normal = np.empty((faces.shape[0], 3))
    volume_and_normals(x, faces, normal)
    press(x, faces, normal, pressure, gradient, out)
