"""Make sim/data/bones.npz and bones.json from the STL files of the `myo-sim` wheel.

Run `pip download --no-deps myo-sim==0.2.4 -d FOLDER` and then
`python scripts/make_bones.py FOLDER/myo_sim-0.2.4-py3-none-any.whl`. The wheel is only read.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
from bone_shapes import (
    MIDLINE,
    MIRROR,
    centreline,
    disc_faces,
    equally_spaced,
    nearest,
    spine_points,
    sternum_outline,
    symmetric,
    tip_mean,
)
from stl_bones import SPINE_LEVELS, Floats, Mesh, chest_bones, read_stl, spine_bones

VERSION = "0.2.4"
RIB_POINTS = 32
OUTLINE_POINTS = 12
ROUNDING = 1e-4  # m, of the stored mesh vertices
PICKS = Path(__file__).with_name("bone_picks.csv")
RIM_CREST_POINTS = 14  # back midline to ASIS, both included
RIM_GROIN_POINTS = 8  # ASIS to pubis, both included


def read_picks() -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Return the points picked by hand, (n, 3) m a group, and the names of the landmarks."""
    with PICKS.open(newline="") as file:
        rows = list(csv.DictReader(file))
    groups: dict[str, list[list[float]]] = {}
    for row in rows:
        groups.setdefault(row["group"], []).append([float(row[f"{axis}_m"]) for axis in "xyz"])
    names = tuple(row["point"] for row in rows if row["group"] == "landmark")
    return {group: np.array(points) for group, points in groups.items()}, names


def pelvis_shift(disc_face: Floats, endplate: Floats) -> Floats:
    """Return the shift (3,) m that puts the sacral endplate (2, 3) under the lowest disc's face."""
    return np.asarray((disc_face - endplate.mean(axis=0)) * MIDLINE)


def pelvis_points(left: Mesh, back: Floats, shift: Floats) -> dict[str, Floats]:
    """Return the rim (40, 3) of the pelvis and its landmarks; both follow from the left side.

    `back` (3,) is where the rim crosses the back midline.
    """
    picks, names = read_picks()
    snapped = {
        group: left.vertices[nearest(left, picks[group] + shift)]
        for group in ("crest", "pubis", "landmark")
    }
    crest, pubis = snapped["crest"], snapped["pubis"]
    middle = pubis[-1] * MIDLINE
    half = np.concatenate(
        [
            equally_spaced(np.array([back, *crest]), RIM_CREST_POINTS),
            equally_spaced(np.array([crest[-1], *pubis, middle]), RIM_GROIN_POINTS)[1:],
        ]
    )
    pairs = np.stack([snapped["landmark"], snapped["landmark"] * MIRROR], axis=1).reshape(-1, 3)
    return {
        "rim": np.concatenate([half, (half * MIRROR)[-2:0:-1]]),
        "landmark_name": np.array([*(f"{n}_{side}" for n in names for side in "LR"), "pubis"]),
        "landmarks": np.array([*pairs, middle]),
    }


def girdle_points(bones: dict[str, Mesh]) -> dict[str, Floats]:
    """Return the ends of clavicles and scapulae, each (2, 3), left then right, symmetric."""
    out = np.array([0.0, 1.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    rules = {
        "clavicle_sternal": ("clavicle", -out, 0.006),
        "clavicle_acromial": ("clavicle", out, 0.006),
        "acromion": ("scapula", out + 0.7 * up, 0.004),
        "inferior_angle": ("scapula", -up, 0.004),
    }
    points = {}
    for name, (bone, direction, depth) in rules.items():
        left = tip_mean(bones[f"{bone}_L"], direction, depth)
        right = tip_mean(bones[f"{bone}_R"], direction * MIRROR, depth)
        points[f"girdle/{name}"] = np.array(symmetric(left, right))
    return points


def assemble(wheel: Path) -> tuple[dict[str, Mesh], dict[str, npt.NDArray[np.generic]]]:
    """Return all bones in one frame, and the derived arrays by key."""
    picks, _ = read_picks()
    bones = chest_bones(wheel)
    vertebrae, discs = spine_bones(wheel)
    bones |= vertebrae
    bones |= {"skull": read_stl(wheel, "hat_skull"), "jaw": read_stl(wheel, "hat_jaw")}
    lowest = discs["L5"]
    shift = pelvis_shift(disc_faces(lowest)[1], picks["sacral_endplate"])
    for bone, name in (("sacrum", "sacrum"), ("pelvis_L", "l_pelvis"), ("pelvis_R", "r_pelvis")):
        bones[bone] = read_stl(wheel, name).moved(shift)
    spine = spine_points(bones, discs)
    arrays: dict[str, npt.NDArray[np.generic]] = {
        f"spine/{key}": value for key, value in spine.items()
    }
    arrays["spine/name"] = np.array([*SPINE_LEVELS, "S1"])
    back = np.array([spine["process"][-2, 0], 0.0, lowest.vertices[:, 2].mean()])
    points = pelvis_points(bones["pelvis_L"], back, shift)
    arrays |= {f"pelvis/{key}": value for key, value in points.items()}
    arrays["pelvis/shift"] = shift
    ribs = [
        symmetric(
            centreline(bones[f"rib_L{n}"], RIB_POINTS), centreline(bones[f"rib_R{n}"], RIB_POINTS)
        )
        for n in range(1, 13)
    ]
    arrays["ribs/centreline"] = np.array([pair[side] for side in (0, 1) for pair in ribs])
    arrays["ribs/name"] = np.array([f"{side}{n}" for side in "LR" for n in range(1, 13)])
    arrays["sternum/outline"] = sternum_outline(bones["sternum"], OUTLINE_POINTS)
    arrays["sternum/rib_facets"] = picks["sternal_end"]
    arrays |= girdle_points(bones)
    return bones, arrays


def main() -> None:
    """Write the two files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--out", type=Path, default=Path("sim/data"))
    options = parser.parse_args()
    bones, arrays = assemble(options.wheel)
    for name, mesh in bones.items():
        rounded = np.round(mesh.vertices / ROUNDING) * ROUNDING
        arrays[f"mesh/{name}/vertices"] = rounded.astype(np.float32)
        arrays[f"mesh/{name}/faces"] = mesh.faces.astype(np.int32)
    np.savez_compressed(options.out / "bones.npz", allow_pickle=False, **arrays)
    about = {
        "source": f"PyPI wheel myo-sim {VERSION}, STL files hat_*, sacrum, l_pelvis, r_pelvis",
        "wheel_sha256": hashlib.sha256(options.wheel.read_bytes()).hexdigest(),
        "licence": "Apache-2.0",
        "changes": "welded, split into bones, logo and discs dropped, turned to body axes, pelvis "
        "and sacrum moved under the lowest disc, vertices rounded to 0.1 mm",
        "axes": "X anterior, Y left, Z up; metres; origin of the hat_* files; no scaling",
        "pelvis_shift_m": [round(float(value), 5) for value in arrays["pelvis/shift"]],
        "bones": {
            name: {"vertices": len(mesh.vertices), "faces": len(mesh.faces)}
            for name, mesh in bones.items()
        },
        "arrays": {
            key: list(value.shape) for key, value in arrays.items() if not key.startswith("mesh/")
        },
    }
    (options.out / "bones.json").write_text(json.dumps(about, indent=1) + "\n")


if __name__ == "__main__":
    main()
