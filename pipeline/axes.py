"""The axes of the body in a laboratory: X anterior, Y left, Z up along the trunk."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.optimize
from scipy.spatial.distance import cdist

from pipeline.labels import MIN_NUMBERED, places, region
from pipeline.raw import Floats
from sim.errors import InputError

# fewer named markers than this do not fix the lean of a trunk against gravity
MIN_NAMED_FOR_LEAN = 6
# the front of a breathing trunk moves at least so many times as far as its back (chestvolume: 2.0)
FRONT_MOVES_MORE = 1.25


def unit(vector: Floats) -> Floats:
    """Vector of length one."""
    return np.asarray(vector / np.linalg.norm(vector))


def rotation(source_points: Floats, target_points: Floats) -> Floats:
    """Rotation R that brings centred `source_points` nearest to the targets: R @ source."""
    moment = (target_points - target_points.mean(axis=0)).T @ (
        source_points - source_points.mean(axis=0)
    )
    u, _, vt = np.linalg.svd(moment)
    sign = np.diag([1.0, 1.0, np.linalg.det(u @ vt)])
    return np.asarray(u @ sign @ vt)


def _is_line(points: Floats) -> bool:
    size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(size[1] < 0.15 * size[0])


def body_axes(
    *,
    source: str,
    mean: Floats,
    motion: Floats,
    spots: list[str],
    posture: str,
    vertical: int,
) -> tuple[Floats, list[str]]:
    """Rows are the body's axes in the laboratory.

    Parameters
    ----------
    mean : (n_markers, 3), m, mean places
    motion : (n_markers, 3, 3), m2, covariance of each marker's motion
    spots : from `pipeline.labels.choose_markers`
    posture : upright or supine
    vertical : laboratory axis that points up, -1 when unknown

    Returns
    -------
    (3, 3) and notes
    """
    notes: list[str] = []
    known = [i for i, spot in enumerate(spots) if spot in places()]
    nominal = np.array([places()[spots[i]].nominal for i in known])
    if posture == "supine":
        if len(known) < 2:
            raise InputError(
                f"{source}: markers: lying down needs two named markers to find the head."
                " Name them in a markers map."
            )
        up, note = _vertical(mean[known], nominal, vertical, axis=0)
        return _about(up, mean[known], nominal, axis=0), [note] if note else []
    if len(known) >= 3 and not _is_line(mean[known]):
        found = rotation(mean[known], nominal)
        up, note = _vertical(mean[known], nominal, vertical, axis=2)
        notes += [note] if note else []
        if len(known) < MIN_NAMED_FOR_LEAN and found[2] @ up > np.cos(np.radians(35.0)):
            found = _about(up, mean[known], nominal, axis=2)
        return found, notes
    up = np.eye(3)[2 if vertical < 0 else vertical]
    ahead = _by_region(mean, spots)
    if len(known) >= 2 and (ahead is None or len(mean) < MIN_NUMBERED):
        notes.append("anterior taken from the direction of the markers' horizontal motion")
        return _from_motion(up, motion[known].mean(axis=0)), notes
    return symmetric_axes(source, mean, motion, up, ahead), notes


def _by_region(mean: Floats, spots: list[str]) -> Floats | None:
    """Direction from the back to the front where a map says which markers are which."""
    front = [i for i, spot in enumerate(spots) if region(spot) == "front"]
    back = [i for i, spot in enumerate(spots) if region(spot) == "back"]
    return mean[front].mean(axis=0) - mean[back].mean(axis=0) if front and back else None


def _vertical(mean: Floats, nominal: Floats, vertical: int, axis: int) -> tuple[Floats, str]:
    """Direction against gravity; from the body itself when the file does not say."""
    if vertical >= 0:
        return np.eye(3)[vertical], ""
    if len(mean) < 3 or _is_line(mean):
        return np.eye(3)[2], "the file does not say which axis is vertical; Z taken"
    found = rotation(mean, nominal)[axis]
    index = int(np.argmax(np.abs(found)))
    up = np.eye(3)[index] * np.sign(found[index])
    if index == 2 and up[2] > 0:
        return up, ""
    return up, f"vertical axis {'-' if up[index] < 0 else ''}{'XYZ'[index]} found from the markers"


def _about(fixed: Floats, mean: Floats, nominal: Floats, axis: int) -> Floats:
    """Axes with one of them fixed, turned about it to the nominal places."""
    others = [(axis + 1) % 3, (axis + 2) % 3]
    helper = np.eye(3)[int(np.argmin(np.abs(fixed)))]
    first = unit(np.cross(fixed, helper))
    second = np.cross(fixed, first)
    flat = (mean - mean.mean(axis=0)) @ np.stack([first, second]).T
    target = (nominal - nominal.mean(axis=0))[:, others]
    angle = np.arctan2(
        np.sum(flat[:, 0] * target[:, 1] - flat[:, 1] * target[:, 0]), np.sum(flat * target)
    )
    # turning the plane by `angle` brings the markers to their nominal directions
    cosine, sine = np.cos(angle), np.sin(angle)
    axes = np.zeros((3, 3))
    axes[axis] = fixed
    axes[others[0]] = cosine * first - sine * second
    axes[others[1]] = sine * first + cosine * second
    return axes


def _from_motion(up: Floats, covariance: Floats) -> Floats:
    flat = np.eye(3) - np.outer(up, up)
    _, vectors = np.linalg.eigh(flat @ covariance @ flat)
    anterior = vectors[:, -1]
    # the chest goes forward while it goes up
    if anterior @ covariance @ up < 0:
        anterior = -anterior
    return np.stack([anterior, np.cross(up, anterior), up])


def symmetric_axes(
    source: str, mean: Floats, motion: Floats, up: Floats, ahead: Floats | None
) -> Floats:
    """Find the axes of a torso without names.

    It is symmetric and wider than deep; its front lies `ahead` or, where that is not known, is
    the side that moves more.
    """
    centred = mean - mean.mean(axis=0)
    planes = _symmetry_planes(centred, up)
    normal = max(planes, key=lambda n: float(np.ptp(centred @ n)))
    axial = unit(up - normal * (up @ normal))
    anterior = np.cross(normal, axial)
    if ahead is None:
        forward = _front_by_motion(source, centred @ anterior > 0, motion)
    else:
        forward = bool(ahead @ anterior > 0)
    if not forward:
        anterior, normal = -anterior, -normal
    axial = _trunk_line(centred, normal, anterior, axial)
    return np.stack([np.cross(normal, axial), normal, axial])


def _front_by_motion(source: str, side: npt.NDArray[np.bool_], motion: Floats) -> bool:
    """Whether the markers of `side` are those on the front."""
    travel = np.sqrt(np.trace(motion, axis1=1, axis2=2))
    moved = [travel[half].mean() if half.any() else 0.0 for half in (side, ~side)]
    if max(moved) < FRONT_MOVES_MORE * min(moved):
        raise InputError(
            f"{source}: markers: geometry does not tell front from back."
            " Name them in a markers map (docs/methods/mocap.md)."
        )
    return bool(moved[0] > moved[1])


def _mirror_error(normal: Floats, offset: float, centred: Floats) -> float:
    normal = unit(normal)
    mirrored = centred - 2.0 * (centred @ normal - offset)[:, None] * normal
    distance = cdist(mirrored, centred)
    return float(distance[scipy.optimize.linear_sum_assignment(distance)].mean())


def _symmetry_planes(centred: Floats, up: Floats) -> list[Floats]:
    """Find the best mirror planes: the sagittal one and, for an oval chest, the frontal."""
    helper = unit(np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))]))
    other = np.cross(up, helper)
    turns, tilts = np.meshgrid(np.radians(np.arange(0, 180, 9)), np.radians(np.arange(-32, 33, 8)))
    starts = [
        np.cos(e) * (np.cos(a) * helper + np.sin(a) * other) + np.sin(e) * up
        for a, e in zip(turns.ravel(), tilts.ravel(), strict=True)
    ]
    starts.sort(key=lambda n: _mirror_error(n, 0.0, centred))
    best = _refine(starts[0], centred)
    across = next(n for n in starts if abs(n @ best) < np.sin(np.radians(30.0)))
    return [best, _refine(across, centred)]


def _refine(normal: Floats, centred: Floats) -> Floats:
    # the stubs of scipy refuse every callable with numpy 2.4
    result = scipy.optimize.minimize(  # type: ignore[call-overload]
        lambda v: _mirror_error(v[:3], float(v[3]), centred),
        np.append(normal, 0.0),
        method="Nelder-Mead",
        options={"maxiter": 300},
    )
    return unit(np.asarray(result.x[:3]))


def _trunk_line(centred: Floats, normal: Floats, anterior: Floats, axial: Floats) -> Floats:
    """Mean direction of the front and back columns within the sagittal plane."""
    breadth = float(np.ptp(centred @ normal))
    directions = []
    for side in (1.0, -1.0):
        column = (np.abs(centred @ normal) < 0.15 * breadth) & (side * (centred @ anterior) > 0)
        if column.sum() < 2 or np.ptp(centred[column] @ axial) < 0.1:
            continue
        flat = centred[column] - np.outer(centred[column] @ normal, normal)
        _, _, vt = np.linalg.svd(flat - flat.mean(axis=0))
        directions.append(vt[0] * np.sign(vt[0] @ axial))
    return unit(np.mean(directions, axis=0)) if len(directions) == 2 else axial
