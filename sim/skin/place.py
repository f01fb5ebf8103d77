"""Laying a person's skin over the bones and the belly of a torso at rest.

The base mesh is warped by landmarks (a triharmonic spline), its arms are lowered, and it is pushed
out wherever a bone or the muscular wall would lie less deep than the layers of `skin_layers.csv`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial.transform import Rotation

from sim.physics.types import Floats, Ints
from sim.skin.body_mesh import MIRROR, BodyMesh, skin_parameters
from sim.skin.clearance import neighbours, outward, push_out
from sim.skin.frame import RestPose, Underneath
from sim.tables import body_size, read_rows

ARMS = 0.6
"""Share of an arm from which on the skin is not pushed: no bone of the arm is drawn."""
BAND = 0.012
"""m, half the height of a band in which the broadest point is looked for."""


def layer_of(part: str, fat_layer: float) -> float:
    """Least thickness over a part, m."""
    p = skin_parameters()
    for row in read_rows("skin_layers.csv"):
        if row["part"] == part:
            more = fat_layer - p["fat_layer"]
            base = 1e-3 * float(row["base_mm"]) + (p["fat_layer"] if part == "belly" else 0.0)
            return float(max(base + float(row["fat_share"]) * more, p["leanest_layer"]))
    raise KeyError(part)


def bone_targets(marks: dict[str, Floats], stature: float) -> dict[str, Floats]:
    """Where the bones put landmarks of the midline, (3,) m each; X of the crotch is not known.

    Parameters
    ----------
    marks : of `RestPose`
    stature : m
    """
    p = skin_parameters()
    over = {
        "notch": p["sternum_skin"], "xiphoid": p["sternum_skin"], "pubis": p["pubis_skin"],
        "c7": -p["neck_skin"], "s1": -p["sacrum_skin"],
    } | dict.fromkeys(("t3", "t8", "t12", "l4"), -p["back_skin"])  # fmt: skip
    out = {name: marks[name] + [ahead, 0.0, 0.0] for name, ahead in over.items()}
    out["sacrum"] = out.pop("s1")
    out["crotch"] = np.array([np.nan, 0.0, marks["pubis"][2] - p["crotch_share"] * stature])
    return out


def head_targets(source: dict[str, Floats], skull: Floats) -> dict[str, Floats]:
    """Where the skull and the jaw, (n, 3) m, put the head: a stretch along the axes.

    Returns
    -------
    (3,) m of crown, occiput, glabella, chin and both temples
    """
    p = skin_parameters()
    low, high = skull.min(axis=0), skull.max(axis=0)
    across = (high[1] + p["temple_skin"]) / source["temple_left"][1]
    names = ("crown", "occiput", "glabella", "chin", "temple_left")

    def mapped(axis: int, ends: tuple[str, str], to: tuple[float, float], value: float) -> float:
        a, b = source[ends[0]][axis], source[ends[1]][axis]
        return float(to[0] + (value - a) / (b - a) * (to[1] - to[0]))

    deep = (low[0] - p["occiput_skin"], high[0] + p["glabella_skin"])
    tall = (low[2] - p["chin_skin"], high[2] + p["crown_skin"])
    out = {
        name: np.array([
            mapped(0, ("occiput", "glabella"), deep, source[name][0]),
            across * source[name][1],
            mapped(2, ("chin", "crown"), tall, source[name][2]),
        ])
        for name in names
    }  # fmt: skip
    return out | {"temple_right": out["temple_left"] * MIRROR}


def _flank(mesh: BodyMesh, height: float) -> Floats:
    """Broadest point (3,) of the trunk's left side at a height, m."""
    near = (np.abs(mesh.vertices[:, 2] - height) < BAND) & (mesh.arm < 0.02)
    band = mesh.vertices[near]
    return np.array(band[np.argmax(band[:, 1])])


def _flanks(
    mesh: BodyMesh, to: dict[str, Floats], sizes: dict[str, float]
) -> list[tuple[str, Floats, Floats]]:
    """Name, place and target, (3,) m each, of the left flank's landmarks: measured breadths."""
    at, out = mesh.landmarks, []
    levels = (
        ("chest_breadth", "xiphoid", "t8", at["xiphoid"][2]),
        ("waist_breadth", "navel", "l4", at["navel"][2]),
        ("hip_breadth", "crotch", "sacrum", at["upper-leg"][2]),
    )
    for size, front, back, height in levels:
        source = _flank(mesh, height)
        moved = source + 0.5 * (to[front] - at[front] + to[back] - at[back])
        share = skin_parameters()["breadth_share"] if sizes else 0.0
        moved[1] += share * (0.5 * sizes.get(size, 0.0) - moved[1])
        out.append((size, source, moved))
    return out


def _targets(mesh: BodyMesh, rest: RestPose, skull: Floats) -> tuple[Floats, Floats]:
    """Landmarks of a mesh of average build (k, 3) and where they go (k, 3), m."""
    at, marks, subject = mesh.landmarks, rest.marks, rest.subject
    to = bone_targets(marks, subject.stature)
    hips = 0.5 * (to["pubis"] - at["pubis"] + to["sacrum"] - at["sacrum"])
    to["crotch"][0] = at["crotch"][0] + hips[0]
    # the belly stays as far before the line from sternum to pubis as the mesh has it
    down = (at["xiphoid"][2] - at["navel"][2]) / (at["xiphoid"][2] - at["pubis"][2])
    ahead = [(to[name] - at[name])[0] for name in ("xiphoid", "pubis")]
    navel = at["navel"] + [(1 - down) * ahead[0] + down * ahead[1], 0.0, 0.0]
    to["navel"] = np.array([navel[0], 0.0, marks["navel"][2]])
    to |= head_targets(at, skull)
    source = dict(at) | {"temple_right": at["temple_left"] * MIRROR}
    sizes = body_size(replace(subject, mass=mesh.build.mass)) if mesh.grown else {}
    flanks = _flanks(mesh, to, sizes)
    for side, letter in ((1.0, "l"), (-1.0, "r")):
        turn = np.array([1.0, side, 1.0])
        shoulder, elbow = at["shoulder"] * turn, at["elbow"] * turn
        joint, lower = (marks[k] * turn for k in ("shoulder", "elbow"))
        long = np.linalg.norm(lower - joint) / np.linalg.norm(elbow - shoulder)
        source |= {f"shoulder_{letter}": shoulder, f"elbow_{letter}": elbow}
        to |= {
            f"shoulder_{letter}": joint,
            f"elbow_{letter}": joint + long * (elbow - shoulder),
        }
        source |= {f"{name}_{letter}": place * turn for name, place, _ in flanks}
        to |= {f"{name}_{letter}": place * turn for name, _, place in flanks}
    return np.array([source[name] for name in to]), np.array(list(to.values()))


def _warped(mesh: BodyMesh, source: Floats, to: Floats, marks: dict[str, Floats]) -> Floats:
    """The mesh (n, 3) warped by landmarks; the arms, whose girth has none, in one piece."""
    warp = RBFInterpolator(source, to, kernel="cubic", degree=1)
    shoulder, elbow = mesh.landmarks["shoulder"], mesh.landmarks["elbow"]
    lower, upper = marks["elbow"], marks["shoulder"]
    long = np.linalg.norm(lower - upper) / np.linalg.norm(elbow - shoulder)
    left = mesh.vertices[:, 1:2] > 0
    arms = np.where(left, upper, upper * MIRROR)
    arms = arms + long * (mesh.vertices - np.where(left, shoulder, shoulder * MIRROR))
    share = mesh.arm[:, None]
    return np.asarray((1.0 - share) * warp(mesh.vertices) + share * arms)


def lowered_arms(vertices: Floats, mesh: BodyMesh, shoulder: Floats) -> Floats:
    """Turn the arms about the shoulders down to `arm_abduction` from the vertical."""
    p = skin_parameters()
    way = mesh.landmarks["elbow"] - mesh.landmarks["shoulder"]
    held = np.arctan2(way[1], -way[2])
    angle = held - np.radians(p["arm_abduction"])
    # the arms of the base mesh are held a little forward or back: they hang straight
    swing = np.arctan2(way[0], np.hypot(way[1], way[2]))
    out = vertices.copy()
    for side, joint in ((1.0, shoulder), (-1.0, shoulder * MIRROR)):
        own = side * vertices[:, 1] > 0
        share = np.where(own, mesh.arm, 0.0)[:, None]
        turn = Rotation.from_euler("xy", [-side * angle, swing])
        # blending the angle instead of the places keeps the shoulder's girth
        vector = turn.as_rotvec() * share
        out = np.where(own[:, None], joint + Rotation.from_rotvec(vector).apply(out - joint), out)
    return out


def place_skin(
    mesh: BodyMesh, average: BodyMesh, rest: RestPose, under: Underneath, *, fat_layer: float
) -> Floats:
    """Skin (n, 3), m, over a torso at rest.

    Parameters
    ----------
    average : of the same person with an average build, whose landmarks lie as near to the bones as
        `skin.csv` says; what the mesh has before it is fat, and stays
    fat_layer : m, least thickness at the navel
    """
    source, to = _targets(average, rest, under.skull)
    warped = _warped(mesh, source, to, rest.marks)
    vertices = lowered_arms(warped, mesh, rest.marks["shoulder"])
    if mesh.build.layer > 0.0:
        near = neighbours(mesh.faces, len(vertices))
        vertices = vertices + mesh.build.layer * outward(vertices, mesh.faces, near)
    return covered(vertices, mesh.faces, under, fat_layer, np.where(mesh.arm > ARMS, 0.0, 1.0))


def covered(
    vertices: Floats, faces: Ints, under: Underneath, fat_layer: float, movable: Floats
) -> Floats:
    """A skin (n, 3), m, pushed out where a layer is too thin; `movable` (n,) is zero elsewhere."""
    layers = {part: layer_of(part, fat_layer) for part in set(under.part)}
    least = np.array([layers[part] for part in under.part])
    reach = skin_parameters()["push_reach"]
    return push_out(vertices, faces, under.points, least, movable, reach)
