"""A trajectory as what the 3D viewer reads: a description (JSON) and packed numbers.

The viewer knows layers, trajectories and a sound only from this description: another surface,
another trajectory beside the first, or a sound that leads the clock need no change in it.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pipeline.packing import Packer, quantise
from pipeline.point_pool import PointPool
from pipeline.skin_packing import pack_skin
from sim.errors import InputError
from sim.motion import Elements, Motion
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

TABLE = Path(__file__).parent / "tables" / "viewer_layers.csv"
TOLERANCE = 2e-4
"""m, of points in the page; 0.3 mm is what was asked."""
MOST_FRAMES = 1500
LEAST_RATE = 12.0
"""Hz; fewer pictures a second are no motion."""
STEPS = 255
MM = 1e3
SKIN = "skin"


@dataclass(frozen=True, kw_only=True, slots=True)
class Scene:
    """What stands in the page.

    Parameters
    ----------
    description : JSON; data : base 64 of deflated numbers
    error : m, largest error of any drawn point; rate : Hz, of the frames that are kept
    """

    description: str
    data: str
    error: float
    rate: float

    @property
    def error_mm(self) -> float:
        """Largest error of any drawn point."""
        return MM * self.error


def layers() -> list[dict[str, Any]]:
    """Rows of `viewer_layers.csv`: what can be shown, how, and how much in each preset."""
    with TABLE.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    fixed = ("layer", "label", "kind", "colour", "order")
    out = []
    for row in rows:
        presets = {k: float(v) for k, v in row.items() if k not in (*fixed, "note")}
        out.append({k: row[k] for k in fixed} | {"order": int(row["order"]), "presets": presets})
    return out


def thinned(motion: Motion, place: str) -> Motion:
    """Every frame, or each second, third ... of a long run.

    Raises
    ------
    InputError
        if too few frames a second would be left
    """
    n = len(motion.time)
    every = -(-n // MOST_FRAMES)
    if every == 1:
        return motion
    rate = (n - 1) / float(np.ptp(motion.time)) / every
    if rate < LEAST_RATE:
        longest = MOST_FRAMES / LEAST_RATE
        raise InputError(
            f"{place}: {np.ptp(motion.time):.0f} s are too long for a page. Simulate at most"
            f" {longest:.0f} s."
        )
    return motion.frames(0, n, every)


def _places(packer: Packer, values: np.ndarray) -> tuple[dict[str, Any], float]:
    """Add (n_frames, n, 3) as they are; return the place and the largest error."""
    small = quantise(values)
    error = np.linalg.norm(np.nan_to_num(small.values() - values), axis=-1).max(initial=0.0)
    return small.put(packer, differences=True), float(error)


class BodyErrors(NamedTuple):
    """Largest errors of places, m, of the numbers of turns, and of a shape's vertex, m."""

    moved: float
    turned: float
    shape: float


def _bodies(packer: Packer, motion: Motion) -> tuple[dict[str, Any], BodyErrors]:
    """Add bodies and their shapes."""
    quaternion = motion.quaternion.copy()
    for frame in range(1, len(quaternion)):
        # q and -q turn alike; neighbours on one side can be interpolated and deflate well
        away = (quaternion[frame] * quaternion[frame - 1]).sum(axis=-1) < 0
        quaternion[frame, away] *= -1
    position, moved = _places(packer, motion.position)
    turn = quantise(quaternion)
    turned = float(np.abs(turn.values() - quaternion).max())
    shapes, far, shifted = [], 0.0, 0.0
    for name, shape in motion.shapes.items():
        small = quantise(shape.vertices)
        far = max(far, float(np.linalg.norm(shape.vertices, axis=1).max()))
        shifted = max(shifted, float(np.abs(small.values() - shape.vertices).max()))
        shapes.append({
            "name": name,
            "layer": str(shape.tissue),
            "body": motion.bodies.index(shape.body),
            "vertices": small.put(packer),
            "faces": packer.add(shape.faces.astype(np.uint16)),
        })  # fmt: skip
    # a quaternion's error of e turns by at most about 4 e
    error = moved + np.sqrt(3) * shifted + 4.0 * turned * far
    places = {"position": position, "quaternion": turn.put(packer, differences=True)}
    return places | {"shapes": shapes}, BodyErrors(moved, turned, error)


def _most_tension(motions: Iterable[Motion]) -> float:
    """Largest tension of any element in any run, N: side by side they have one scale."""
    found = [float(m.elements.tension.max()) for m in motions if m.elements is not None]
    return max(found, default=0.0) or 1e-9


def _muscles(packer: Packer, elements: Elements, ends: np.ndarray, most: float) -> dict[str, Any]:
    """Add the elements' ends in the pool of points, and the root of their tension over `most`."""
    groups = sorted(set(elements.group))
    level = np.sqrt(np.clip(elements.tension / most, 0.0, 1.0))
    return {
        "groups": [g.replace("_", " ") for g in groups],
        "group": packer.add(np.array([groups.index(g) for g in elements.group], dtype=np.uint8)),
        "ends": packer.add(ends.reshape(-1, 2).astype(np.uint16)),
        "tension": packer.add(np.round(STEPS * level).astype(np.uint8), differences=True),
        "most_n": most,
    }


def _series(motion: Motion) -> list[dict[str, Any]]:
    """Curves that are read out below the picture."""
    told = [("lung volume", "L", 2, motion.volumes["lung"] / CUBIC_METRE_PER_LITRE)]
    names = {"pleural": "pleural pressure", "abdomen": "abdominal"}
    told += [(t, "cmH2O", 1, motion.pressures[k] / PASCAL_PER_CMH2O) for k, t in names.items()]
    return [
        {"name": name, "unit": unit, "digits": digits, "values": values.round(3).tolist()}
        for name, unit, digits, values in told
        if np.isfinite(values).all()
    ]


def _trajectory(
    packer: Packer, name: str, motion: Motion, most: float
) -> tuple[dict[str, Any], float]:
    bodies, wrong = _bodies(packer, motion)
    human = motion.skin
    if human is not None:
        motion = replace(motion, soft={k: s for k, s in motion.soft.items() if k != SKIN})
    pool = PointPool(motion, TOLERANCE)
    # riders are off by their own error and by that of the body that carries them
    errors = [wrong.shape + pool.error]
    out: dict[str, Any] = {
        "name": name,
        "time": [round(t, 4) for t in (motion.time - motion.time[0]).tolist()],
        "bodies": bodies,
        "points": pool.put(packer),
        "surfaces": [
            {
                "layer": layer,
                "faces": packer.add(soft.faces.astype(np.uint16)),
                "points": packer.add(pool.index(part).astype(np.uint16)),
            }
            for part, (layer, soft) in enumerate(motion.soft.items())
        ],
        "series": _series(motion),
    }
    if human is not None:
        abdomen = pool.index(list(motion.soft).index("abdomen"))
        skin, error = pack_skin(
            packer, human, abdomen, moved=wrong.moved, turned=wrong.turned, soft=errors[0]
        )
        faces = packer.add(human.faces.astype(np.uint16))
        out["surfaces"].append({"layer": SKIN, "faces": faces, "skin": skin})
        errors.append(error)
    if motion.elements is not None:
        out["muscles"] = _muscles(packer, motion.elements, pool.index(len(motion.soft)), most)
    simulated, error = _places(packer, motion.markers)
    errors.append(error)
    out["markers"] = {"names": list(motion.marker_names), "simulated": simulated}
    if motion.measured is not None:
        seen = np.asarray(np.isfinite(motion.measured).all(axis=(0, 2)))
        filled = np.where(seen[:, None], motion.measured, motion.markers)
        out["markers"]["measured"], error = _places(packer, filled)
        out["markers"]["seen"] = seen.tolist()
        errors.append(error)
    return out, max(errors)


def _clock(motions: Mapping[str, Motion], span: tuple[float, float] | None) -> dict[str, Any]:
    """Time at which the clock begins, how long it runs, and how late each trajectory begins."""
    first = [float(motion.time[0]) for motion in motions.values()]
    if span is None:
        longest = max(float(np.ptp(motion.time)) for motion in motions.values())
        start, duration, delays = first[0], longest, [0.0] * len(first)
    else:
        start, duration = span[0], span[1] - span[0]
        delays = [begun - start for begun in first]
    return {
        "start": round(start, 4),
        "duration": round(duration, 4),
        "delays": [round(delay, 4) for delay in delays],
    }


def build_scene(
    motions: Mapping[str, Motion],
    *,
    place: str,
    facts: Sequence[str] = (),
    loop: bool = True,
    span: tuple[float, float] | None = None,
    steps: Sequence[Mapping[str, Any]] = (),
) -> Scene:
    """Pack one trajectory, or several that are shown side by side.

    Parameters
    ----------
    motions : by the name that is shown
    place : file that an error names
    facts : short lines shown with the picture
    loop : whether the motion repeats itself, as a breath does
    span : s, of the clock on the trajectories' own time; else each begins with its first frame
    steps : name, inspiration and period (s) of each trajectory, if one at a time is to be chosen
    """
    clock = _clock(motions, span)
    delays = clock.pop("delays")
    most = _most_tension(motions.values())
    packer, told, errors, rate = Packer(), [], [], np.inf
    for (name, motion), delay in zip(motions.items(), delays, strict=True):
        kept = thinned(motion, place)
        if len(kept.time) > 1:
            rate = min(rate, (len(kept.time) - 1) / float(np.ptp(kept.time)))
        one, error = _trajectory(packer, name, kept, most)
        told.append({**one, "delay": delay})
        errors.append(error)
    description = {
        "trajectories": told, "layers": layers(), "facts": list(facts), "loop": loop, **clock,
    }  # fmt: skip
    if steps:
        description["steps"] = [dict(step) for step in steps]
    return Scene(
        # `</script` and `<!--` must not end or break the element that holds it
        description=json.dumps(description, separators=(",", ":")).replace("<", "\\u003c"),
        data=packer.text(),
        error=max(errors),
        rate=float(rate),
    )
