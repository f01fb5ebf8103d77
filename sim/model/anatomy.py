"""Where the bones of a subject lie: one bone set, corrected and scaled to size.

The bone set is short, shallow and has ribs too flat; `sim/data/parameters.csv` holds the
corrections (section `bones`). All points are at end expiration, upright, in metres: X
anterior, Y left, Z up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.errors import ParameterError
from sim.model.girdle import girdle_places
from sim.physics.types import Floats
from sim.tables import Parameters, body_size, bone_arrays, read_rows

SIDES = ("L", "R")


@dataclass(frozen=True, kw_only=True, slots=True)
class Subject:
    """Whom the torso is built for.

    Parameters
    ----------
    sex : "male" or "female"
    stature : m
    mass : kg
    """

    sex: str
    stature: float
    mass: float

    def __post_init__(self) -> None:
        if self.sex not in ("male", "female"):
            raise ParameterError(f"sex is {self.sex!r}. Use male or female.")
        if not 1.2 <= self.stature <= 2.3:
            raise ParameterError(f"stature is {self.stature} m. Give 1.2 to 2.3 m.")
        if not 15.0 <= self.mass <= 250.0:
            raise ParameterError(f"mass is {self.mass} kg. Give 15 to 250 kg.")


@dataclass(frozen=True, kw_only=True, slots=True)
class Anatomy:
    """Bone landmarks of one subject, m.

    Parameters
    ----------
    rib : (2, 12, n, 3), centrelines from head to tip, left and right
    facet : (2, 7, 3), sternal ends of cartilages 1 to 7
    sternum_front, sternum_back : (n, 3), midline from jugular notch to xiphoid tip
    spine : level name -> (3,), centre of the vertebral body
    front, process : level name -> (3,), front of the body, tip of the spinous process
    joint : level name -> (3,), lower end plate
    skull_base : (3,)
    girdle : name -> (2, 3), landmarks of shoulder girdles and arms, left and right
    pelvis_rim : (n, 3), from the back midline over the left crest to the pubis and back
    scale : (3,), of this subject against the reference man
    skin : thickness of everything between the chest sheet and the skin, m
    belly_skin : the same at the belly wall
    navel_height : m, on the Z axis
    """

    rib: Floats
    facet: Floats
    sternum_front: Floats
    sternum_back: Floats
    spine: dict[str, Floats]
    front: dict[str, Floats]
    process: dict[str, Floats]
    joint: dict[str, Floats]
    skull_base: Floats
    girdle: dict[str, Floats]
    pelvis_rim: Floats
    scale: Floats
    skin: float
    belly_skin: float
    navel_height: float


def subject_scale(subject: Subject, parameters: Parameters) -> Floats:
    """Per-axis size of the bones against the reference man of 1.756 m."""
    tall = subject.stature / parameters["reference_stature"]
    radial = 1.0 if subject.sex == "male" else parameters["female_radial"]
    return np.array([tall * radial, tall * radial, tall])


def _stretch(points: Floats, levels: dict[str, Floats], parameters: Parameters) -> Floats:
    """The per-axis corrections; the lumbar spine is stretched more than the rib cage."""
    top, bottom = levels["T12"][2], levels["L5"][2]
    low = min(top, bottom)
    high = max(top, bottom)
    z = points[..., 2]
    above = np.maximum(z - high, 0.0) * parameters["bones_z"]
    between = (np.clip(z, low, high) - low) * parameters["bones_z_lumbar"]
    below = np.minimum(z - low, 0.0) * parameters["bones_z_pelvis"]
    out = points.copy()
    out[..., 0] *= parameters["bones_x"]
    out[..., 1] *= parameters["bones_y"]
    out[..., 2] = above + between + below
    return out


def turn_down(points: Floats, head: Floats, angle: Floats | float) -> Floats:
    """Turn points (..., 3), m, down by an angle, rad, about the transverse axis through a head."""
    c, s = np.cos(angle), np.sin(angle)
    arm = points - head
    turned = arm.copy()
    turned[..., 0] = c * arm[..., 0] + s * arm[..., 2]
    turned[..., 2] = -s * arm[..., 0] + c * arm[..., 2]
    return np.asarray(head + turned)


def _lower_ribs(rib: Floats, facet: Floats, angle: Floats) -> tuple[Floats, Floats, Floats]:
    """Turn every rib down about the transverse axis through its head.

    Returns
    -------
    ribs; 2 x 2 rotation and shift in the sagittal plane by which the sternum follows
    """
    lowered = turn_down(rib, rib[:, :, :1], angle[:, None])
    move = (lowered - rib)[:, :7, -1].mean(axis=0)[:, ::2]
    before = facet.mean(axis=0)[:, ::2]
    after = before + move
    p, q = before - before.mean(axis=0), after - after.mean(axis=0)
    turn = np.arctan2((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum())
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    shift = after.mean(axis=0) - rotation @ before.mean(axis=0)
    return lowered, rotation, shift


def rib_tilts() -> Floats:
    """(12,), how far each rib of the bone set is turned down about its head, rad.

    `rib_joints.csv`: enough for the heights of notch and tenth rib (ANSUR II), more below than
    above as the slopes grow towards the tenth rib.
    """
    return np.radians([float(row["tilt_deg"]) for row in read_rows("rib_joints.csv")])


def _follow(points: Floats, rotation: Floats, shift: Floats) -> Floats:
    out = points.copy()
    out[..., ::2] = points[..., ::2] @ rotation.T + shift
    return out


class Placer:
    """The corrections of the bone set, before any size.

    Calling it stretches points (..., 3), m, of the bone set; `ribs` (2, 12, n, 3) are lowered,
    `facets` (2, 7, 3) are where the stretch puts them, and `follow` takes what is on the sternum
    along with the ribs.
    """

    def __init__(self, parameters: Parameters) -> None:
        bones = bone_arrays()
        names = [str(n) for n in bones["spine/name"]]
        self.parameters = parameters
        self.origin = bones["spine/bottom"][names.index("L5")]
        centres = zip(names, bones["spine/centre"], strict=True)
        self.levels = {name: at - self.origin for name, at in centres}
        rib = self(bones["ribs/centreline"]).reshape(2, 12, -1, 3)
        rib[1] = rib[0] * [1.0, -1.0, 1.0]
        left = self(bones["sternum/rib_facets"])
        self.facets = np.stack([left, left * [1.0, -1.0, 1.0]])
        self.ribs, self._rotation, self._shift = _lower_ribs(rib, self.facets, rib_tilts())

    def __call__(self, points: Floats) -> Floats:
        """Stretched points, from the lower end of the lumbar spine."""
        moved = np.asarray(points, dtype=float) - self.origin
        return _stretch(moved, self.levels, self.parameters)

    def follow(self, points: Floats) -> Floats:
        """Stretched points of the sternum, moved as the front ends of the ribs are."""
        return _follow(points, self._rotation, self._shift)


def build_anatomy(subject: Subject, parameters: Parameters, fit_scale: Floats) -> Anatomy:
    """Corrected and scaled bone landmarks.

    Parameters
    ----------
    fit_scale : (3,), per-axis factors on top of the population's size
    """
    bones = bone_arrays()
    names = [str(n) for n in bones["spine/name"]]
    scale = subject_scale(subject, parameters) * fit_scale
    place = Placer(parameters)
    rib, facet = place.ribs, place.facets
    outline = place.follow(place(bones["sternum/outline"]))
    outline[..., 1] = 0.0
    size = body_size(subject)

    def levels_of(key: str) -> dict[str, Floats]:
        points = place(bones[key]) * scale
        points[:, 1] = 0.0
        return dict(zip(names, points, strict=True))

    girdle = {name: place(at) * scale for name, at in girdle_landmarks(bones).items()}
    rim = place(bones["pelvis/rim"])
    front = outline[0] * scale
    notch = front[np.argmax(front[:, 2])]
    tall = subject.stature * fit_scale[2]
    skin = max(parameters["least_skin"], 0.5 * (size["chest_breadth"] - _breadth(rib * scale)))
    return Anatomy(
        rib=rib * scale,
        facet=place.follow(facet) * scale,
        sternum_front=front,
        sternum_back=outline[1] * scale,
        spine=levels_of("spine/centre"),
        front=levels_of("spine/front"),
        process=levels_of("spine/process"),
        joint=levels_of("spine/bottom"),
        skull_base=levels_of("spine/top")["C1"],
        girdle=girdle_places(
            girdle, notch, 0.5 * size["biacromial_breadth"] * fit_scale[1], tall, parameters
        ),
        pelvis_rim=rim * scale,
        scale=scale,
        skin=skin,
        belly_skin=parameters["belly_skin"],
        navel_height=notch[2]
        - (size["jugular_notch_height"] - size["navel_height"]) * fit_scale[2],
    )


def girdle_landmarks(bones: dict[str, np.ndarray]) -> dict[str, Floats]:
    """Left clavicle and scapula, (3,) each, and the notch, in the bone set's own frame."""
    names = ("clavicle_sternal", "clavicle_acromial", "acromion", "inferior_angle")
    out = {name: np.asarray(bones[f"girdle/{name}"][0]) for name in names}
    scapula, front = bones["mesh/scapula_L/vertices"], bones["sternum/outline"][0]
    out["coracoid"] = scapula[np.argmax(scapula[:, 0])]
    out["superior_angle"] = scapula[np.argmax(scapula[:, 2] - scapula[:, 1])]
    out["notch"] = front[np.argmax(front[:, 2])] * [1.0, 0.0, 1.0]
    return out


def _breadth(rib: Floats) -> float:
    """Greatest breadth of the rib cage, centreline to centreline, m."""
    return float(np.ptp(rib[:, :, :, 1]))
