"""Size and place of the torso from the mean marker positions at the end of expiration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pipeline.body import remove_trunk
from pipeline.model import BreathModel, Runs
from pipeline.nearest import Nearest, nearest_on_mesh
from pipeline.settings import FitSettings
from sim.errors import InputError

Floats = NDArray[np.float64]

MAX_ROUNDS = 30
SETTLED = 1e-4
"""m; the search ends when no point moves further in a round."""
HEIGHTS = (-0.06, -0.03, 0.0, 0.03, 0.06)
"""m; where on the torso a search without landmarks starts, from the likeliest height."""
OUTLIER_SCALE = 2.0
"""In standard deviations: beyond it a misplaced marker counts linearly, not squared."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Registration:
    """Where the torso is and how large.

    Parameters
    ----------
    fit_scale : (3,), size factors of X, Y, Z on the size that the tables give
    rotation : (3, 3) and translation : (3,), m: torso = rotation @ recording + translation
    points : (n_markers, 3), m, marker centres, a marker's radius off the torso's skin at rest
    residual : (n_markers,), m, from each placed marker to its point, less the marker's radius
    landmarks : names used as landmarks
    notes : what was assumed, one line each
    """

    fit_scale: tuple[float, float, float]
    rotation: Floats
    translation: Floats
    points: Floats
    residual: Floats
    landmarks: tuple[str, ...]
    notes: tuple[str, ...]

    def to_recording(self, positions: Floats) -> Floats:
        """Torso positions (..., 3) m in the axes of the recording."""
        return np.asarray((positions - self.translation) @ self.rotation)


def as_recorded(runs: Runs, registration: Registration, back: tuple[int, ...]) -> Floats:
    """Markers of runs as a recording of them would hold them; NaN where a run failed.

    A recording's places are relative to its back markers. The torso's must be, too: what its spine
    does has been taken out of the measured side.

    Parameters
    ----------
    back : markers by which the recording's trunk motion was removed, empty if it was not

    Returns
    -------
    (n, n_frames, n_markers, 3), m, in the recording's axes
    """
    positions = registration.to_recording(np.asarray(runs.positions))
    for number, failed in enumerate(runs.failed):
        if failed:
            positions[number] = np.nan
        elif back:
            positions[number], _ = remove_trunk(positions[number], list(back), [])
    return positions


@dataclass(frozen=True, kw_only=True, slots=True)
class _Target:
    """The torso at rest as the search sees it, and which marker is which landmark."""

    vertices: Floats
    faces: NDArray[np.int64]
    places: Floats
    named: NDArray[np.int64]
    front: NDArray[np.int64]
    height: float
    free_scale: bool


def _move(parameters: Floats, markers: Floats) -> Floats:
    turned = Rotation.from_rotvec(parameters[:3]).apply(markers)
    return np.asarray(turned + parameters[3:6])


def _nearest(placed: Floats, scale: Floats, target: _Target) -> Nearest:
    return nearest_on_mesh(placed, target.vertices * scale, target.faces)


def _residuals(
    parameters: Floats, markers: Floats, near: Nearest, target: _Target, settings: FitSettings
) -> Floats:
    scale = np.exp(parameters[6:9])
    placed = _move(parameters, markers)
    # the foot of each marker was found at the scale of the last round, kept in `near.points`
    foot = near.points * scale
    away = np.sum((placed - foot) * near.normals, axis=1) - settings.marker_radius_m
    parts = [away / settings.surface_sd_m, parameters[:3] / settings.rotation_sd_rad]
    named = placed[target.named] - target.places * scale
    parts.append((named / settings.landmark_sd_m).ravel())
    if len(target.named) == 0:
        middle = placed[:, 2].mean() - target.height * scale[2]
        parts.append(np.array([middle / settings.height_sd_m]))
    if len(target.front):
        parts.append(placed[target.front, 1] / settings.landmark_sd_m)
    parts.append(parameters[6:9] / (settings.scale_sd if target.free_scale else 1e-6))
    return np.concatenate(parts)


def _search(
    start: Floats, markers: Floats, target: _Target, settings: FitSettings
) -> tuple[Floats, float]:
    """Alternate nearest points and least squares until the markers rest; place and cost."""
    parameters, cost = start, np.inf
    for _ in range(MAX_ROUNDS):
        scale = np.exp(parameters[6:9])
        before = _move(parameters, markers)
        near = _nearest(before, scale, target)
        unscaled = Nearest(points=near.points / scale, normals=near.normals)
        found = least_squares(
            _residuals,
            parameters,
            args=(markers, unscaled, target, settings),
            loss="soft_l1",
            f_scale=OUTLIER_SCALE,
            x_scale=np.repeat([0.1, 0.01, 0.05], 3),
        )
        parameters, cost = found.x, float(found.cost)
        if np.max(np.abs(_move(parameters, markers) - before)) < SETTLED:
            break
    return parameters, cost


def _search_heights(markers: Floats, target: _Target, settings: FitSettings) -> Floats:
    """Best of several starts: a marker set without names fits the skin at several heights."""
    start = _start(markers, target)
    tries = []
    for height in HEIGHTS if len(target.named) == 0 else (0.0,):
        lifted = start.copy()
        lifted[5] += height
        tries.append(_search(lifted, markers, target, settings))
    return min(tries, key=lambda found: found[1])[0]


def _target(
    names: tuple[str, ...],
    sagittal: tuple[int, ...],
    seen: NDArray[np.bool_],
    surface: tuple[Floats, NDArray[np.int64]],
    landmarks: dict[str, Floats],
    free_scale: bool,
) -> _Target:
    kept = {int(old): new for new, old in enumerate(np.flatnonzero(seen))}
    named = [i for i in kept if names[i] in landmarks]
    places = np.array([landmarks[names[i]] for i in named]).reshape(-1, 3)
    heights = [landmarks[n][2] for n in ("CLAV", "NAVEL") if n in landmarks]
    vertices, faces = surface
    return _Target(
        vertices=np.asarray(vertices, dtype=float),
        faces=np.asarray(faces, dtype=np.int64),
        places=places,
        named=np.array([kept[i] for i in named], dtype=np.int64),
        front=np.array([kept[i] for i in sagittal if i in kept], dtype=np.int64),
        height=float(np.mean(heights) if heights else np.mean(vertices[:, 2])),
        free_scale=free_scale,
    )


def _start(markers: Floats, target: _Target) -> Floats:
    """No turn; landmarks on landmarks if there are any, else the middles of both."""
    if len(target.named):
        shift = (target.places - markers[target.named]).mean(axis=0)
    else:
        middle = (target.vertices.max(axis=0) + target.vertices.min(axis=0)) / 2
        shift = np.array([middle[0], middle[1], target.height]) - markers.mean(axis=0)
        if np.ptp(markers[:, 0]) < np.ptp(target.vertices[:, 0]) / 2:
            # all markers on the front: start in front of the skin, or the back may win
            shift[0] = target.vertices[:, 0].max() - markers[:, 0].max()
    return np.concatenate([np.zeros(3), shift, np.zeros(3)])


def register(
    model: BreathModel,
    markers: Floats,
    names: tuple[str, ...],
    sagittal: tuple[int, ...],
    posture: str,
    settings: FitSettings,
) -> Registration:
    """Size the torso and place the markers on its skin.

    Parameters
    ----------
    markers : (n_markers, 3), m, mean positions at the end of expiration in the recording's
        axes (body axes), NaN for a marker that is never seen there
    names : canonical names, "" where none; sagittal : indices of the front column
    """
    seen = np.asarray(np.isfinite(markers).all(axis=1))
    if not seen.any():
        raise InputError("registration: no marker is visible at the end of expiration. Check gaps.")
    free_scale = int(seen.sum()) >= settings.min_scale_markers
    unit = (1.0, 1.0, 1.0)
    at_rest = model.surface(unit, posture)
    landmarks = model.landmarks(unit, posture)
    target = _target(
        names, sagittal, seen, (at_rest.vertices, at_rest.faces), landmarks, free_scale
    )
    found = _search_heights(markers[seen], target, settings)
    x, y, z = np.exp(found[6:9]) if free_scale else np.ones(3)
    fit_scale = (float(x), float(y), float(z))
    if free_scale:
        # the resized torso is solved anew and is not exactly the stretched one: place it again
        at_rest, landmarks = model.surface(fit_scale, posture), model.landmarks(fit_scale, posture)
        target = _target(names, sagittal, seen, (at_rest.vertices, at_rest.faces), landmarks, False)
        found, _ = _search(np.append(found[:6], np.zeros(3)), markers[seen], target, settings)
    placed = _move(found, np.where(seen[:, None], markers, np.nanmean(markers, axis=0)))
    near = _nearest(placed, np.ones(3), target)
    away = np.abs(np.linalg.norm(placed - near.points, axis=1) - settings.marker_radius_m)
    return Registration(
        fit_scale=fit_scale,
        rotation=Rotation.from_rotvec(found[:3]).as_matrix(),
        translation=found[3:6],
        points=near.points + settings.marker_radius_m * near.normals,
        residual=np.where(seen, away, np.nan),
        landmarks=tuple(names[i] for i in np.flatnonzero(seen) if names[i] in landmarks),
        notes=_notes(free_scale, len(target.named), int(seen.sum()), len(names)),
    )


def _notes(free_scale: bool, n_named: int, n_seen: int, n_markers: int) -> tuple[str, ...]:
    notes = []
    if not free_scale:
        notes.append(
            f"{n_seen} markers cannot tell the torso's size: it is that of the tables for the "
            "subject's sex, stature and mass"
        )
    if n_named == 0:
        notes.append(
            "no marker has the name of a landmark: the height on the torso rests on a weak prior"
        )
    if n_seen < n_markers:
        notes.append(f"{n_markers - n_seen} markers were not seen and have no place on the skin")
    return tuple(notes)
