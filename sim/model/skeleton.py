"""Rigid bodies: spine, skull, ribs, sternum, cartilages and the central tendon."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from sim.model.anatomy import SIDES, Anatomy, Subject
from sim.model.bodies import add_body, ball, printed_masses
from sim.model.girdle import add_girdles, girdle_joints
from sim.physics.plant import Joints, Tree
from sim.physics.types import Floats
from sim.tables import Parameters, read_rows

SEGMENTS = {
    "L4-L5": ("L5", "L4"),
    "L1-L3": ("L3", "L1"),
    "T9-T12": ("T12", "T9"),
    "T5-T8": ("T8", "T5"),
    "T1-T4": ("T4", "T1"),
    "C4-C7": ("C7", "C4"),
    "C1-C3": ("C3", "C1"),
}
"""Vertebrae of each spine segment, lowest and highest (dilorenzo2009, section 3.1.1)."""


def segment_of(level: str) -> str:
    """Spine segment that holds a vertebra such as `T7`."""
    kind, number = level[0], int(level[1:])
    for name, (low, high) in SEGMENTS.items():
        if low[0] == kind and int(high[1:]) <= number <= int(low[1:]):
            return name
    return "pelvis"


@dataclass(frozen=True, kw_only=True, slots=True)
class Skeleton:
    """Compiled rigid bodies with their joints.

    Parameters
    ----------
    model : MuJoCo model; body 0 is the pelvis
    body : name -> index
    joints : elastic joints, rest angles zero
    tree : the kinematic tree as arrays
    """

    model: mujoco.MjModel
    body: dict[str, int]
    joints: Joints
    tree: Tree


def cartilage_line(anatomy: Anatomy, side: int, rib: int) -> tuple[Floats, Floats]:
    """Lateral and sternal end of a costal cartilage, rib 1 to 7."""
    return anatomy.rib[side, rib - 1, -1], anatomy.facet[side, rib - 1]


def margin_point(anatomy: Anatomy, side: int, t: float, parameters: Parameters) -> Floats:
    """Point of the costal margin, from beside the xiphoid (t = 0) to the tenth rib (t = 1)."""
    tip = anatomy.rib[side, 9, -1]
    start = anatomy.sternum_back[-2].copy()
    start[1] = np.sign(tip[1]) * parameters["xiphoid_half_width"]
    point = (1.0 - t) * start + t * tip
    point[0] += parameters["margin_bulge"] * np.sin(np.pi * t)
    return np.asarray(point)


def spine_bodies(index: dict[str, int]) -> set[int]:
    """Bodies of the vertebral column and of the pelvis, given the numbers of all by name."""
    return {index[name] for name in ("pelvis", *SEGMENTS)}


def body_masses(subject: Subject, parameters: Parameters) -> dict[str, float]:
    """Masses of the bodies, kg: shares of the body's mass, or those of dilorenzo2009 Table 8.2.

    "ribs" is the mass of all 24.
    """
    if parameters["printed_masses"]:
        printed = printed_masses()
        return printed | {"ribs": 24.0 * printed["rib"]}
    trunk = parameters["upper_trunk_share"] * subject.mass
    masses = {row["body"]: float(row["share"]) * trunk for row in read_rows("masses.csv")}
    masses["skull"] = parameters["head_share"] * subject.mass
    return masses


def _rib_masses(anatomy: Anatomy, mass: float, *, alike: bool) -> Floats:
    """(2, 12), kg, of ribs of `mass` together: all alike, or by their length."""
    length = np.array([[_length(line) for line in side] for side in anatomy.rib])
    if alike:
        return np.full(length.shape, mass / length.size)
    return np.asarray(mass * length / (2.0 * sum(length[0].tolist())))


def _add_ribs(
    bodies: dict[str, mujoco.MjsBody], anatomy: Anatomy, at: dict[str, Floats], masses: Floats
) -> None:
    for side, letter in enumerate(SIDES):
        for i in range(12):
            name, line = f"rib_{letter}{i + 1}", anatomy.rib[side, i]
            parent, mass = segment_of(f"T{i + 1}"), float(masses[side, i])
            bodies[name] = add_body(bodies[parent], name, line[0], at[parent], line, mass, 0.02)
            ball(bodies[name], name)
            at[name] = line[0]


def _length(line: Floats) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def _add_cartilage(
    bodies: dict[str, mujoco.MjsBody],
    anatomy: Anatomy,
    origin: Floats,
    masses: dict[str, float],
    parameters: Parameters,
) -> None:
    for side, letter in enumerate(SIDES):
        for rib in (2, 3, 4, 5, 6):
            if rib < 6:
                name = f"cartilage_{letter}{rib}"
                outer, inner = cartilage_line(anatomy, side, rib)
                points = np.linspace(outer, inner, 8)
            else:
                name = f"cartilage_{letter}6-10"
                inner = 0.5 * (anatomy.facet[side, 5] + anatomy.facet[side, 6])
                margin = [margin_point(anatomy, side, t, parameters) for t in (0.2, 0.5, 0.8)]
                tips = anatomy.rib[side, 5:10, -1]
                points = np.vstack([tips, margin, inner])
                outer = tips.mean(axis=0)
            part = name.replace(f"_{letter}", "_")
            body = add_body(bodies["sternum"], name, inner, origin, points, masses[part], 0.01)
            along = (outer - inner) / np.linalg.norm(outer - inner)
            up = np.array([0.0, 0.0, 1.0]) - along[2] * along
            up /= np.linalg.norm(up)
            for axis, label in ((up, "yaw"), (np.cross(along, up), "pitch")):
                body.add_joint(
                    name=f"{name}_{label}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=list(axis)
                )
            bodies[name] = body


def build_skeleton(
    subject: Subject, anatomy: Anatomy, tendon: Floats, parameters: Parameters
) -> Skeleton:
    """Assemble and compile the rigid bodies.

    Parameters
    ----------
    tendon : (n, 3), points of the central tendon
    """
    spec = mujoco.MjSpec()
    spec.compiler.balanceinertia = True
    masses = body_masses(subject, parameters)
    bodies: dict[str, mujoco.MjsBody] = {"pelvis": spec.worldbody}
    at: dict[str, Floats] = {"pelvis": np.zeros(3)}
    parent = "pelvis"
    for name, (low, high) in SEGMENTS.items():
        base = anatomy.joint[low]
        levels = [v for k, v in anatomy.spine.items() if segment_of(k) == name]
        points = np.vstack([levels, [anatomy.process[low], anatomy.process[high]]])
        bodies[name] = add_body(bodies[parent], name, base, at[parent], points, masses[name], 0.06)
        ball(bodies[name], name)
        at[name], parent = base, name
    base = anatomy.skull_base
    head = base + np.array([[0.0, 0.0, 0.03], [0.09, 0.0, 0.12], [-0.07, 0.0, 0.12]])
    bodies["skull"] = add_body(
        bodies[parent], "skull", base, at[parent], head, masses["skull"], 0.08
    )
    ball(bodies["skull"], "skull")
    ribs = _rib_masses(anatomy, masses["ribs"], alike=bool(parameters["printed_masses"]))
    _add_ribs(bodies, anatomy, at, ribs)
    middle = anatomy.sternum_back.mean(axis=0)
    line = np.vstack([anatomy.sternum_front, anatomy.sternum_back, *anatomy.facet])
    bodies["sternum"] = add_body(
        spec.worldbody, "sternum", middle, np.zeros(3), line, masses["sternum"], 0.01
    )
    bodies["sternum"].add_freejoint(name="sternum")
    _add_cartilage(bodies, anatomy, middle, masses, parameters)
    add_girdles(bodies, anatomy.girdle, middle, subject.mass, parameters)
    centre = tendon.mean(axis=0)
    bodies["central_tendon"] = add_body(
        spec.worldbody, "central_tendon", centre, np.zeros(3), tendon,
        parameters["tendon_mass"], 0.01,
    )  # fmt: skip
    bodies["central_tendon"].add_freejoint(name="central_tendon")
    model = spec.compile()
    index = {n: (0 if n == "pelvis" else model.body(n).id) for n in bodies}
    return Skeleton(
        model=model,
        body=index,
        joints=_build_joints(model, index, anatomy, parameters),
        tree=_build_tree(model),
    )


def _build_tree(model: mujoco.MjModel) -> Tree:
    last = np.full(model.nbody, -1, dtype=np.int64)
    for b in range(1, model.nbody):
        count = model.body_dofnum[b]
        last[b] = model.body_dofadr[b] + count - 1 if count else last[model.body_parentid[b]]

    def whole(values: object) -> np.ndarray:
        return np.array(values, dtype=np.int64)

    return Tree(
        body_root=whole(model.body_rootid),
        body_parent=whole(model.body_parentid),
        body_last_dof=last,
        dof_body=whole(model.dof_bodyid),
        dof_parent=whole(model.dof_parentid),
        m_start=whole(model.M_rowadr),
        m_count=whole(model.M_rownnz),
        m_column=whole(model.M_colind),
    )


def rib_axes(rib: int, side: int) -> Floats:
    """Rows: rib-neck axis (pointing back and out), vertical axis, the axis across both."""
    row = read_rows("rib_joints.csv")[rib - 1]
    angle = np.radians(float(row["axis_angle_from_sagittal_deg"]))
    sign = 1.0 if side == 0 else -1.0
    neck = np.array([-np.cos(angle), sign * np.sin(angle), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([neck, up, np.cross(neck, up)])


def _build_joints(
    model: mujoco.MjModel, body: dict[str, int], anatomy: Anatomy, parameters: Parameters
) -> Joints:
    balls = []
    limits = {row["upper"].lower(): row for row in read_rows("spine_limits.csv")}
    for name in (*SEGMENTS, "skull"):
        b = body[name]
        mass = float(model.body_subtreemass[b])
        reach = parameters["spine_reach"]
        k = parameters["spine_frequency"] ** 2 * mass * reach**2
        k = max(k, parameters["spine_least_stiffness"])
        d = 2.0 * parameters["spine_damping_ratio"] * k / parameters["spine_frequency"]
        row = limits[name.lower()]
        flexion, extension = float(row["flexion_deg"]), float(row["extension_deg"])
        bend, twist = float(row["lateral_bending_deg"]), float(row["rotation_deg"])
        edge = np.radians([bend, flexion, twist, bend, extension, twist])
        balls.append((name, k * np.eye(3), d * np.eye(3), edge, 10.0 * k))
    # Ligaments of the same material: stiffness against turning goes with the cube of the size.
    cube = float(np.prod(anatomy.scale))
    usual = [parameters[f"rib_stiffness_{a}"] for a in ("neck", "vertical", "across")]
    for side, letter in enumerate(SIDES):
        for rib in range(1, 13):
            axes = rib_axes(rib, side)
            first = parameters["rib_stiffness_first"] / rib if rib <= 2 else 0.0
            stiffness = [usual[0] + first, *usual[1:]]
            k3 = cube * axes.T @ np.diag(stiffness) @ axes
            friction = cube * parameters["rib_friction"] * np.eye(3)
            edge = np.full(6, np.pi)
            edge[1] = np.radians(parameters["rib_expiratory_limit"])
            hold = cube * parameters["rib_limit_stiffness"]
            balls.append((f"rib_{letter}{rib}", k3, friction, edge, hold))
    for name, hold, slow in girdle_joints(parameters):
        balls.append((name, hold * np.eye(3), slow * np.eye(3), np.full(6, np.pi), 0.0))
    hinges = [j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE]
    n = len(hinges)
    ids = [model.joint(b[0]).id for b in balls]
    return Joints(
        ball_dof=model.jnt_dofadr[ids].astype(np.int64),
        ball_qpos=model.jnt_qposadr[ids].astype(np.int64),
        ball_stiffness=np.array([b[1] for b in balls]),
        ball_damping=np.array([b[2] for b in balls]),
        ball_rest=np.zeros((len(balls), 3)),
        ball_limit=np.array([b[3] for b in balls]),
        limit_stiffness=np.array([b[4] for b in balls]),
        hinge_dof=model.jnt_dofadr[hinges].astype(np.int64),
        hinge_qpos=model.jnt_qposadr[hinges].astype(np.int64),
        hinge_stiffness=np.full(n, cube * parameters["cartilage_bending"]),
        hinge_damping=np.full(n, parameters["cartilage_damping"]),
        hinge_rest=np.zeros(n),
    )
