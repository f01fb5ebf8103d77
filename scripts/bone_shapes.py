"""Centrelines, vertebral levels and landmarks taken from the bone meshes."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_splprep
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from stl_bones import SPINE_LEVELS, Floats, Ints, Mesh

MIRROR = np.array([1.0, -1.0, 1.0])
MIDLINE = np.array([1.0, 0.0, 1.0])


def subdivided(mesh: Mesh) -> Mesh:
    """Split every triangle in four."""
    pairs = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, back = np.unique(pairs, axis=0, return_inverse=True)
    middle = mesh.vertices[edges].mean(axis=1)
    a, b, c = mesh.faces.T
    ab, bc, ca = (back.reshape(-1, 3) + len(mesh.vertices)).T
    faces = np.concatenate(
        [np.stack(three, axis=1) for three in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    )
    return Mesh(vertices=np.concatenate([mesh.vertices, middle]), faces=faces)


def surface_share(mesh: Mesh) -> Floats:
    """Return per vertex the share (0 at the head, 1 at the tip) of the way along a rib."""
    pairs = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges = np.unique(pairs, axis=0)
    length = np.linalg.norm(np.diff(mesh.vertices[edges], axis=1)[:, 0], axis=1)
    size = len(mesh.vertices)
    graph = coo_array((length, (edges[:, 0], edges[:, 1])), shape=(size, size)).tocsr()

    def reach(start: int) -> Floats:
        return np.asarray(dijkstra(graph, directed=False, indices=np.array([start]))[0])

    far = int(np.argmax(reach(0)))
    first = reach(far)
    opposite = int(np.argmax(first))
    second = reach(opposite)
    share = first / (first + second)
    head_last = abs(mesh.vertices[far, 1]) > abs(mesh.vertices[opposite, 1])
    return np.asarray(1.0 - share if head_last else share)


def section(mesh: Mesh, value: Floats, level: float) -> Floats:
    """Return the segments (n, 2, 3) on the mesh where `value` (vertices,) equals `level`."""
    above = value[mesh.faces] > level
    cut = mesh.faces[above.any(axis=1) & ~above.all(axis=1)]
    crossings = []
    for first, second in ((0, 1), (1, 2), (2, 0)):
        low, high = value[cut[:, first]], value[cut[:, second]]
        crosses = (low > level) != (high > level)
        part = np.where(crosses, (level - low) / np.where(crosses, high - low, 1.0), np.nan)
        start, stop = mesh.vertices[cut[:, first]], mesh.vertices[cut[:, second]]
        crossings.append(start + part[:, None] * (stop - start))
    three = np.stack(crossings, axis=1)
    return np.asarray(three[~np.isnan(three[:, :, 0])].reshape(-1, 2, 3))


def section_centre(mesh: Mesh, value: Floats, level: float) -> Floats:
    """Return the centroid (3,) of the outline where `value` on the vertices equals `level`."""
    pairs = section(mesh, value, level)
    weight = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1)
    return np.asarray(np.average(pairs.mean(axis=1), axis=0, weights=weight))


def midline(mesh: Mesh) -> Floats:
    """Return points (n, 3), 41 a segment, of the cut of a mesh with the midsagittal plane."""
    pairs = section(mesh, mesh.vertices[:, 1], 0.0)
    part = np.linspace(0.0, 1.0, 41)[None, :, None]
    points = pairs[:, :1] + part * (pairs[:, 1:] - pairs[:, :1])
    return np.asarray(points.reshape(-1, 3))


def equally_spaced(points: Floats, count: int) -> Floats:
    """Return `count` points at equal arc length on the polyline `points` (n, 3)."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(step)])
    wanted = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(wanted, along, points[:, axis]) for axis in range(3)])


def centreline(rib: Mesh, count: int, smoothing: float = 0.0005) -> Floats:
    """Return `count` points (count, 3) m along the middle of a rib, head to tip.

    `smoothing` is the root mean square distance, m, the curve may leave the section centres.
    """
    fine = subdivided(subdivided(rib))
    share = surface_share(fine)
    levels = np.linspace(0.04, 0.96, 47)
    middle = np.array([section_centre(fine, share, level) for level in levels])
    spline, _ = make_splprep(middle.T, k=3, s=len(middle) * smoothing**2)
    curve = spline(np.linspace(0.0, 1.0, 400)).T
    reach = [fine.vertices[share < 0.02], fine.vertices[share > 0.98]]
    head = extended(curve[0], curve[0] - curve[12], reach[0])
    tip = extended(curve[-1], curve[-1] - curve[-13], reach[1])
    return equally_spaced(np.concatenate([head[None], curve, tip[None]]), count)


def extended(start: Floats, direction: Floats, ends: Floats) -> Floats:
    """Go from `start` along `direction` as far as the mesh points `ends` (n, 3) reach."""
    unit = direction / np.linalg.norm(direction)
    return np.asarray(start + max(0.0, float(((ends - start) @ unit).mean())) * unit)


def disc_faces(disc: Mesh) -> tuple[Floats, Floats]:
    """Return the centres (3,) of the upper and lower face of an intervertebral disc."""
    centre = disc.vertices.mean(axis=0)
    normal = np.linalg.svd(disc.vertices - centre)[2][2]
    normal = normal if normal[2] > 0 else -normal
    upper = (disc.vertices - centre) @ normal > 0
    middles = [
        0.5 * (half.min(axis=0) + half.max(axis=0))
        for half in (disc.vertices[upper], disc.vertices[~upper])
    ]
    flat = [point * MIDLINE for point in middles]
    return flat[0], flat[1]


def spine_points(bones: dict[str, Mesh], discs: dict[str, Mesh]) -> dict[str, Floats]:
    """Return centre, top, bottom, process and front, each (25, 3): C1..C7, T1..T12, L1..L5, S1."""
    top = np.full((25, 3), np.nan)
    bottom = np.full((25, 3), np.nan)
    for index, level in enumerate(SPINE_LEVELS[1:], start=1):
        bottom[index], top[index + 1] = disc_faces(discs[level])
    ring = bones["C1"]
    top[0] = [bottom[1, 0] + 0.5 * (top[2, 0] - bottom[3, 0]), 0.0, ring.high[2]]
    bottom[0] = top[1] = 0.5 * (top[0] + bottom[1])
    bottom[24] = top[24]
    process = np.zeros((25, 3))
    front = np.zeros((25, 3))
    for index, name in enumerate((*SPINE_LEVELS, "sacrum")):
        outline = midline(bones[name])
        process[index], front[index] = ends_of_level(outline, top[index], bottom[index])
    return {
        "centre": 0.5 * (top + bottom),
        "top": top,
        "bottom": bottom,
        "process": process,
        "front": front,
    }


def ends_of_level(outline: Floats, top: Floats, bottom: Floats) -> tuple[Floats, Floats]:
    """Return the tip of the spinous process and the front middle of the body, each (3,)."""
    centre = 0.5 * (top + bottom)
    axis = top - bottom
    height = float(np.linalg.norm(axis))
    if height < 1e-6:
        near = outline[outline[:, 2] > outline[:, 2].max() - 0.03]
        return near[np.argmin(near[:, 0])], near[np.argmax(near[:, 0])]
    axis = axis / height
    ahead = np.array([axis[2], 0.0, -axis[0]])
    level = np.abs((outline - centre) @ axis) < 0.1 * height
    near = outline[level] if level.any() else outline
    front = near[np.argmax((near - centre) @ ahead)]
    behind = outline[(outline - centre) @ ahead < -0.01]
    tip = behind[np.argmax(np.linalg.norm(behind - centre, axis=1))]
    return tip, front


def sternum_outline(sternum: Mesh, count: int) -> Floats:
    """Return midline points (2, count, 3): front then back, jugular notch to xiphoid tip."""
    outline = midline(sternum)
    low, high = outline[:, 2].min() + 0.001, outline[:, 2].max() - 0.001
    result = np.zeros((2, count, 3))
    for index, height in enumerate(np.linspace(high, low, count)):
        near = outline[np.abs(outline[:, 2] - height) < 0.0015]
        result[0, index] = [near[:, 0].max(), 0.0, height]
        result[1, index] = [near[:, 0].min(), 0.0, height]
    return result


def tip_mean(mesh: Mesh, direction: Floats, depth: float) -> Floats:
    """Return the mean (3,) of the vertices within `depth` m of the end towards `direction`."""
    reach = mesh.vertices @ direction
    return np.asarray(mesh.vertices[reach > reach.max() - depth].mean(axis=0))


def symmetric(left: Floats, right: Floats) -> tuple[Floats, Floats]:
    """Average a left and a right shape (..., 3) as mirror images of each other."""
    middle = 0.5 * (left + right * MIRROR)
    return middle, middle * MIRROR


def nearest(mesh: Mesh, points: Floats) -> Ints:
    """Return the vertex numbers (n,) nearest to `points` (n, 3)."""
    distance = np.linalg.norm(mesh.vertices[None] - points[:, None], axis=2)
    return np.asarray(distance.argmin(axis=1))
