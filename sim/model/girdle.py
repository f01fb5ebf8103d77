"""Shoulder girdles and arms: six bodies on the sternum and the muscles that hold and move them.

Each girdle, clavicle and scapula in one, turns about the sternoclavicular joint (dilorenzo2009,
section 3.1.3 and Table 8.2). Its weight and the arm's are carried, by the tone of trapezius and
levator upright and by the bed lying; only their inertia rides on the sternum.
"""

from __future__ import annotations

import mujoco
import numpy as np

from sim.model.bodies import add_body, ball, printed_masses
from sim.model.mesh import along
from sim.model.muscles import MuscleList
from sim.model.points import Points
from sim.model.strengths import layer_width
from sim.physics.types import Floats
from sim.tables import Parameters, read_rows

SIDES = ("L", "R")
MIRROR = np.array([1.0, -1.0, 1.0])


def girdle_places(raw: dict[str, Floats], notch: Floats, half_breadth: float, tall: float,
                  p: Parameters) -> dict[str, Floats]:  # fmt: skip
    """Landmarks of both girdles and arms.

    The bone set's shoulders are narrow and stand high: they are widened to the population's
    biacromial breadth and rolled down about the sternoclavicular joint. Its shoulder blades are
    swung outwards; their medial border is brought back beside the spine.

    Parameters
    ----------
    raw : (3,) each, m, of the left side: clavicle_sternal, clavicle_acromial, acromion,
        superior_angle, inferior_angle, coracoid
    notch : (3,), jugular notch, m
    half_breadth : of the shoulders, acromion to midline, m
    tall : stature, m

    Returns
    -------
    (2, 3) each, left and right: the same names, and shoulder, elbow, hand
    """
    inner = p["sternoclavicular_half_spacing"] * tall / p["reference_stature"]
    start, tip = raw["clavicle_sternal"], raw["acromion"]
    wide = (half_breadth - inner) / (tip[1] - start[1])
    joint = np.array([notch[0] + (start[0] - raw["notch"][0]), inner, notch[2]])
    rise = notch[2] + p["acromion_above_notch"] - joint[2]
    arm = np.array([0.0, wide, 1.0]) * (tip - start)
    roll = np.arctan2(rise, arm[1]) - np.arctan2(arm[2], arm[1])
    c, s = np.cos(roll), np.sin(roll)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    left = {
        name: joint + turn @ (np.array([1.0, wide, 1.0]) * (at - start))
        for name, at in raw.items()
        if name != "notch"
    }
    for name in ("superior_angle", "inferior_angle"):
        left[name][1] = p["scapula_border"] * tall / p["reference_stature"]
    left["shoulder"] = left["acromion"] - np.array([0.0, 0.0, p["shoulder_below_acromion"]])
    left["elbow"] = left["shoulder"] - np.array([0.0, 0.0, p["upper_arm_length"] * tall])
    reach = (p["forearm_length"] + p["hand_length"]) * tall
    left["hand"] = left["elbow"] - np.array([0.0, 0.0, reach])
    return {name: np.stack([at, at * MIRROR]) for name, at in left.items()}


def girdle_mass(mass: float, p: Parameters) -> dict[str, float]:
    """Mass of one girdle, upper arm and forearm with hand, kg, in a body of `mass`."""
    shares = {"girdle": 0.5 * p["girdle_share"], "upper_arm": p["upper_arm_share"]}
    shares["forearm"] = p["forearm_share"]
    masses = {part: share * mass for part, share in shares.items()}
    if p["printed_masses"]:
        masses["girdle"] = printed_masses()["girdle"]
    return masses


def girdle_outline(places: dict[str, Floats], side: int) -> dict[str, Floats]:
    """Points (n, 3), the first the joint, over which each body's mass is spread, m."""
    at = {name: both[side] for name, both in places.items()}
    bones = ("clavicle_sternal", "clavicle_acromial", "acromion", "superior_angle",
             "inferior_angle", "coracoid")  # fmt: skip
    return {
        "girdle": np.array([at[name] for name in bones]),
        "upper_arm": np.linspace(at["shoulder"], at["elbow"], 5),
        "forearm": np.linspace(at["elbow"], at["hand"], 5),
    }


def add_girdles(
    bodies: dict[str, mujoco.MjsBody], places: dict[str, Floats], origin: Floats, mass: float,
    p: Parameters,
) -> None:  # fmt: skip
    """Hang girdle, upper arm and forearm on the sternum, whose frame is at `origin`, both sides.

    Parameters
    ----------
    bodies : added to
    mass : of the whole body, kg
    """
    masses = girdle_mass(mass, p)
    for side, letter in enumerate(SIDES):
        parent, at = "sternum", origin
        for part, outline in girdle_outline(places, side).items():
            name = f"{part}_{letter}"
            bodies[name] = add_body(
                bodies[parent], name, outline[0], at, outline, masses[part], 0.03
            )
            ball(bodies[name], name)
            parent, at = name, outline[0]


def girdle_joints(p: Parameters) -> list[tuple[str, float, float]]:
    """Name, stiffness (N m/rad) and damping (N m s/rad) of the six ball joints."""
    kinds = (("girdle", "girdle"), ("upper_arm", "arm"), ("forearm", "elbow"))
    return [
        (f"{part}_{letter}", p[f"{kind}_stiffness"], p[f"{kind}_damping"])
        for letter in SIDES
        for part, kind in kinds
    ]


def add_carried(
    points: Points, body: dict[str, int], places: dict[str, Floats], mass: float, p: Parameters
) -> tuple[list[int], list[float]]:
    """Handles at the centres of mass of everything whose weight is carried, and the masses, kg."""
    handles, weights = [], []
    masses = girdle_mass(mass, p)
    for side, letter in enumerate(SIDES):
        for part, outline in girdle_outline(places, side).items():
            handles.append(points.add(body[f"{part}_{letter}"], outline.mean(axis=0)))
            weights.append(masses[part])
    return handles, weights


class GirdleBuilder:
    """Strings the muscles of the shoulder girdle: the rows of `girdle_muscles.csv`."""

    def __init__(
        self,
        points: Points,
        muscles: MuscleList,
        body: dict[str, int],
        places: dict[str, Floats],
        origins: dict[str, dict[str, Floats]],
        ribs: Floats,
        segment: dict[str, str],
        parameters: Parameters,
    ) -> None:
        """Parameters: `origins` of "spine" and "skull" by level, `ribs` (2, 12, n, 3)."""
        self.points, self.muscles, self.body = points, muscles, body
        self.places, self.origins, self.ribs, self.segment = places, origins, ribs, segment
        self.parameters = parameters

    def build(self) -> None:
        """Add every row on both sides."""
        for row in read_rows("girdle_muscles.csv"):
            width = layer_width(row["group"], float(row["area_mm2"]) * 1e-6, self.parameters)
            for side in (0, 1):
                handles = [self._origin(row, side), self._insertion(row, side)]
                self.muscles.add_chain(row["group"], handles, [width])

    def _origin(self, row: dict[str, str], side: int) -> int:
        sign = 1.0 - 2.0 * side
        if row["from"] == "rib":
            line = self.ribs[side, int(row["at"]) - 1]
            place = along(line, np.array([float(row["along"])]))[0]
            return self.points.add(self.body[f"rib_{SIDES[side]}{row['at']}"], place)
        place = self.origins[row["from"]][row["at"]]
        place = place + np.array([0.0, sign * float(row["lateral_mm"]) * 1e-3, 0.0])
        name = "skull" if row["from"] == "skull" else self.segment[row["at"]]
        return self.points.add(self.body[name], place)

    def _insertion(self, row: dict[str, str], side: int) -> int:
        at, share = {k: v[side] for k, v in self.places.items()}, float(row["share"])
        if row["to"] == "clavicle":
            place = (1 - share) * at["clavicle_sternal"] + share * at["clavicle_acromial"]
        elif row["to"] == "border":
            place = (1 - share) * at["superior_angle"] + share * at["inferior_angle"]
        else:
            place = at[row["to"]]
        return self.points.add(self.body[f"girdle_{SIDES[side]}"], place)
