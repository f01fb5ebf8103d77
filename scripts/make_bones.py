"""Make sim/data/bones.npz and bones.json from the STL files of the `myo-sim` wheel.

Run `pip download --no-deps myo-sim==0.2.4 -d FOLDER` and then
`python scripts/make_bones.py FOLDER/myo_sim-0.2.4-py3-none-any.whl`. The wheel is only read.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
from bone_shapes import (
    MIRROR,
    centreline,
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
RIM_POINTS = 40
ROUNDING = 1e-4  # m, of the stored mesh vertices
# Read off the sternum mesh by eye, +-5 mm: left ends of cartilages 1-7, body axes, m.
STERNAL_ENDS = np.array(
    [
        [0.031, 0.020, 0.366],
        [0.050, 0.020, 0.331],
        [0.062, 0.020, 0.306],
        [0.070, 0.020, 0.284],
        [0.077, 0.020, 0.263],
        [0.082, 0.020, 0.247],
        [0.085, 0.020, 0.229],
    ]
)
# Picked on the left pelvis mesh, in its own frame (origin midway between the hips' front spines).
PELVIS_PICKS = {
    "PSIS": [-0.138, 0.041, 0.017],
    "crest_back": [-0.105, 0.055, 0.072],
    "crest_inner": [-0.093, 0.066, 0.080],
    "crest_top": [-0.076, 0.076, 0.081],
    "crest_top_outer": [-0.074, 0.095, 0.073],
    "crest_outer": [-0.052, 0.114, 0.066],
    "crest_middle": [-0.050, 0.128, 0.045],
    "crest_side": [-0.023, 0.132, 0.036],
    "crest_front": [-0.004, 0.129, 0.011],
    "ASIS": [0.000, 0.121, 0.000],
    "pubic_tubercle": [0.000, 0.027, -0.080],
    "pubis": [-0.003, 0.007, -0.077],
}
RIM_ORDER = (
    "crest_back",
    "crest_inner",
    "crest_top",
    "crest_top_outer",
    "crest_outer",
    "crest_middle",
    "crest_side",
    "crest_front",
    "ASIS",
    "pubic_tubercle",
    "pubis",
)
# Front lip and back edge of the sacral endplate on the midline of the sacrum mesh, its own frame.
ENDPLATE_PICKS = np.array([[-0.064, 0.0, 0.0356], [-0.0994, 0.0, 0.0599]])


def pelvis_shift(lowest_disc: Floats) -> Floats:
    """Return the shift (3,) m that puts the sacral endplate under the lowest disc's face."""
    return np.asarray((lowest_disc - ENDPLATE_PICKS.mean(axis=0)) * np.array([1.0, 0.0, 1.0]))


def pelvis_points(left: Mesh, shift: Floats, back: Floats) -> dict[str, Floats]:
    """Return the landmarks and the rim loop of the pelvis."""
    picks = np.array(list(PELVIS_PICKS.values())) + shift
    found = dict(zip(PELVIS_PICKS, left.vertices[nearest(left, picks)], strict=True))
    pubis = found["pubis"] * np.array([1.0, 0.0, 1.0])
    half = np.array([back, *(found[name] for name in RIM_ORDER), pubis])
    half = equally_spaced(half, RIM_POINTS // 2 + 1)
    names, points = [], []
    for name in ("ASIS", "PSIS", "crest_top", "crest_side", "pubic_tubercle"):
        names += [f"{name}_L", f"{name}_R"]
        points += [found[name], found[name] * MIRROR]
    return {
        "rim": np.concatenate([half, (half * MIRROR)[-2:0:-1]]),
        "landmark_name": np.array([*names, "pubis"]),
        "landmarks": np.array([*points, pubis]),
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
    bones = chest_bones(wheel)
    vertebrae, discs = spine_bones(wheel)
    bones |= vertebrae
    bones |= {"skull": read_stl(wheel, "hat_skull"), "jaw": read_stl(wheel, "hat_jaw")}
    lowest = discs["L5"]
    bones["sacrum"] = read_stl(wheel, "sacrum")
    spine = spine_points(bones, discs)
    shift = pelvis_shift(spine["top"][-1])
    bones["sacrum"] = bones["sacrum"].moved(shift)
    for side, name in (("L", "l_pelvis"), ("R", "r_pelvis")):
        bones[f"pelvis_{side}"] = read_stl(wheel, name).moved(shift)
    spine = spine_points(bones, discs)
    arrays = {f"spine/{key}": value for key, value in spine.items()}
    arrays["spine/name"] = np.array([*SPINE_LEVELS, "S1"])
    back = np.array([spine["process"][-2, 0], 0.0, lowest.vertices[:, 2].mean()])
    points = pelvis_points(bones["pelvis_L"], shift, back)
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
    arrays["sternum/rib_facets"] = STERNAL_ENDS
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
