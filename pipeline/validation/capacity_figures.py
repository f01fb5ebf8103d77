"""Figures of a vital capacity: what moves between residual volume, rest and total capacity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from pipeline.validation.behaviours import Run
from pipeline.validation.breath_figures import spine_turn
from pipeline.validation.static_figures import Figures, falls, rib_means
from sim.model.torso import Torso
from sim.physics.types import Floats, Ints
from sim.resting import RestingTorso
from sim.simulate import Trajectory, replay, skin_frames
from sim.summary import Breath, compartments, find_breaths, rib_rotations
from sim.ultrasound import dome_excursion

LITRES, CM, PERCENT = 1e3, 1e2, 1e2
TAPES = {"upper": (("LUCH", "RUCH"), "T5"), "lower": (("XIPH",), "T10")}
"""Where a tape lies, in front and behind (Debouche 2016)."""
ONE_LITRE = 1e-3


def some_frames(trajectory: Trajectory, frames: list[int]) -> Trajectory:
    """The same run with only some of its frames; tensions are left out."""
    names = ("time", "qpos", "soft", "lung", "chest", "abdomen", "alveolar", "pleural",
             "abdominal", "flow")  # fmt: skip
    chosen = {name: getattr(trajectory, name)[frames] for name in names}
    return replace(trajectory, **chosen, tension=np.zeros((0, 0)))


def girth(vertices: Floats, faces: Ints, front: Floats, back: Floats) -> float:
    """Length of a tape round a skin, m, in the plane through two points that runs sideways.

    Parameters
    ----------
    vertices, faces : (n, 3) m, (m, 3)
    front, back : (3,), m
    """
    along = (front - back) / np.linalg.norm(front - back)
    normal = np.cross(along, [0.0, 1.0, 0.0])
    normal /= np.linalg.norm(normal)
    height = (vertices - back) @ normal
    points = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = faces[:, i], faces[:, j]
        cut = height[a] * height[b] < 0.0
        share = (height[a] / np.where(cut, height[a] - height[b], 1.0))[cut, None]
        points.append(vertices[a][cut] + share * (vertices[b] - vertices[a])[cut])
    ring = np.vstack(points) - back
    flat = np.stack([ring @ along, ring @ np.cross(normal, along)], axis=1)
    return float(ConvexHull(flat).area)


def _girths(run: Run, resting: RestingTorso, low: int, high: int) -> Figures:
    skins = skin_frames(resting, some_frames(run.trajectory, [low, high]))
    names = run.motion.marker_names
    out: Figures = {}
    for tape, (front, back) in TAPES.items():
        ends = [
            (run.motion.markers[frame][[names.index(n) for n in front]].mean(axis=0),
             run.motion.markers[frame][names.index(back)])
            for frame in (low, high)
        ]  # fmt: skip
        round_ = [
            girth(skin, resting.skin.faces, *end) for skin, end in zip(skins, ends, strict=True)
        ]
        out[f"girth_{tape}"] = CM * (round_[1] - round_[0])
    return out


def contours(torso: Torso, places: Floats) -> dict[str, Floats]:
    """Lengths of the diaphragm's contours rim to rim through the tendon, m, (n_frames,) each.

    Parameters
    ----------
    places : (n_frames, n_columns, n_rows, 3), of `torso.diaphragm`, rim first
    """
    fibre = np.linalg.norm(np.diff(places, axis=2), axis=3).sum(axis=2)
    still = torso.places[torso.diaphragm[:, -1]]
    middle = still.mean(axis=0)
    half = 0.5 * float(np.abs(still[:, 1]).max())

    def nearest(x: float, y: float) -> int:
        spot = np.array([x, y])
        return int(np.argmin(np.linalg.norm(still[:, :2] - spot, axis=1)))

    def line(a: int, b: int) -> Floats:
        across = np.linalg.norm(places[:, a, -1] - places[:, b, -1], axis=1)
        return np.asarray(fibre[:, a] + across + fibre[:, b])

    far = 1.0
    ends = (
        [i for i in range(len(still)) if still[i, 0] > middle[0]],
        [i for i in range(len(still)) if still[i, 0] <= middle[0]],
    )

    def dome(y: float) -> Floats:
        return line(*(min(side, key=lambda i: abs(float(still[i, 1]) - y)) for side in ends))

    return {
        "coronal": line(nearest(float(middle[0]), -far), nearest(float(middle[0]), far)),
        "right_sagittal": dome(-half),
        "left_sagittal": dome(half),
        "fibre": np.asarray(fibre.mean(axis=1)),
    }


def _diaphragm(run: Run, resting: RestingTorso, b: Breath, litre: int) -> Figures:
    torso = resting.torso
    frames = some_frames(run.trajectory, [0, b.low, b.high, litre])
    shape = (-1, *torso.diaphragm.shape, 3)
    places = replay(resting, frames, torso.diaphragm.ravel()).points.reshape(shape)
    length = contours(torso, places)
    out = {f"shortening_{name}": PERCENT * float(1.0 - x[2] / x[1]) for name, x in length.items()}
    for side in ("right", "left"):
        x = length[f"{side}_sagittal"]
        out[f"shortening_litre_{side}"] = CM * float(x[0] - x[3])
    return out


def capacity_figures(run: Run, resting: RestingTorso) -> Figures:
    """Figures of a full expiration and inspiration."""
    m = run.motion
    b = find_breaths(m, 1.0 / run.rate)[-1]
    lung = m.volumes["lung"]
    swept, inspired = compartments(m, b.low, b.high), float(lung[b.high] - lung[b.low])
    dome = dome_excursion(m, run.rest, 0, b.high)
    way = m.markers[b.high] - m.markers[b.low]
    size = dict(zip(m.marker_names, 1e3 * np.linalg.norm(way, axis=1), strict=True))
    rest = float(run.rest.volumes["lung"][0])
    rising = np.arange(b.low, b.high + 1)
    litre = int(rising[np.argmin(np.abs(lung[rising] - rest - ONE_LITRE))])
    turned = rib_means(rib_rotations(m, run.rest, b.high), "rib")
    return {
        "vital_capacity": LITRES * inspired,
        "largest_volume": LITRES * float(lung[b.high]),
        "least_volume": LITRES * float(lung[b.low]),
        "dome_right": CM * dome["right"],
        "dome_left": CM * dome["left"],
        "rib_cage_share": swept["rib_cage"] / (swept["rib_cage"] + swept["belly"]),
        "diaphragm_share": swept["diaphragm"] / inspired,
        "sternum_way": float(size["STRN"]),
        "navel_way": float(size["NAVEL"]),
        "diaphragm_share_litre": compartments(m, 0, litre)["diaphragm"] / float(lung[litre] - rest),
        "spine_turn": spine_turn(m, b),
        "falls": falls(turned, "rib", range(1, 11)),
        **turned,
        **_girths(run, resting, b.low, b.high),
        **_diaphragm(run, resting, b, litre),
    }
