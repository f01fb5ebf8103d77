"""The torso: bones, cavities, muscles and lung of one subject, ready to run."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from sim.model.anatomy import Anatomy, Subject, build_anatomy
from sim.model.cavity import Cavity, CavityBuilder
from sim.model.contacts import build_contacts, off_the_spine
from sim.model.dome import tendon_edge
from sim.model.girdle import GirdleBuilder, add_carried
from sim.model.links import build_links
from sim.model.mesh import orient
from sim.model.muscles import (
    MuscleList,
    TissueList,
    pack_muscles,
    pack_tissue,
)
from sim.model.points import Points
from sim.model.sheets import SheetBuilder
from sim.model.skeleton import Skeleton, build_skeleton, segment_of, spine_bodies
from sim.model.trunk_muscles import TrunkMuscleBuilder
from sim.physics.blocks import analyse
from sim.physics.muscle import HILL
from sim.physics.plant import Constants, Links, Plant
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats, Ints
from sim.tables import Parameters, read_rows
from sim.tables import parameters as calibrated

__all__ = ["Subject", "Torso", "build_torso"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Torso:
    """A torso in its built pose; `sim.rest` finds its equilibrium.

    Parameters
    ----------
    subject, parameters, anatomy : what it was built from
    skeleton : rigid bodies
    plant : everything as flat arrays
    places : (n_points, 3), all points as built, bound points first, m
    diaphragm, wall : (n_columns, n_rows), point indices, rim first
    n_dome : faces of the diaphragm, the last of both cavities
    outer : (n, 3), faces of the tube that carries the skin (rib cage and belly), outward
    rows : (2, 12) lists, points of the sheet along each rib
    """

    subject: Subject
    parameters: Parameters
    anatomy: Anatomy
    skeleton: Skeleton
    plant: Plant
    places: Floats
    diaphragm: Ints
    wall: Ints
    n_dome: int
    outer: Ints
    rows: list[list[Ints]]

    @property
    def n_particles(self) -> int:
        """Free particles."""
        return len(self.plant.particle_inertia)

    @property
    def n_bound(self) -> int:
        """Points that ride on bodies."""
        return len(self.plant.point_body)


def lung_capacity(subject: Subject) -> dict[str, float]:
    """Predicted lung volumes of a 30-year-old, m^3, and peak expiratory flow, m^3/s."""
    out = {}
    for row in read_rows("lung_volumes.csv"):
        if row["sex"] == subject.sex:
            litres = float(row["per_m"]) * subject.stature + float(row["per_year"]) * 30.0
            out[row["quantity"]] = 1e-3 * (litres + float(row["constant"]))
    return out


def build_torso(
    subject: Subject,
    *,
    fit_scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
    parameters: Parameters | None = None,
) -> Torso:
    """Build the torso of a subject.

    Parameters
    ----------
    fit_scale : per-axis size factors (X, Y, Z) on top of the population's size
    parameters : numbers of the model, the calibrated set unless given
    """
    p = calibrated() if parameters is None else parameters
    anatomy = build_anatomy(subject, p, np.asarray(fit_scale, dtype=float))
    around = np.concatenate([anatomy.rib[0, :, 0], anatomy.rib[0, :, -1]])
    tendon = tendon_edge(anatomy, p, np.vstack([around, around * [1.0, -1.0, 1.0]]))
    skeleton = build_skeleton(subject, anatomy, tendon, p)
    points = Points()
    cavity = CavityBuilder(points, skeleton.body, anatomy, p).build()
    driven = frozenset(row["group"] for row in p.rows("levels.csv"))
    muscles, tissue = MuscleList(groups=driven), TissueList()
    TrunkMuscleBuilder(points, muscles, skeleton.body, anatomy, p).build()
    GirdleBuilder(
        points, muscles, skeleton.body, anatomy.girdle,
        {"spine": anatomy.spine, "skull": {"base": anatomy.skull_base}}, anatomy.rib,
        {level: segment_of(level) for level in anatomy.spine}, p,
    ).build()  # fmt: skip
    hung = add_carried(points, skeleton.body, anatomy.girdle, subject.mass, p)
    if p["equal_point_masses"]:
        # The tendon is points of the sheet like all others, which have no weight of their own.
        hung[0].append(points.add(skeleton.body["central_tendon"], tendon.mean(axis=0)))
        hung[1].append(p["tendon_mass"])
    sheets = SheetBuilder(points, muscles, tissue, cavity, float(anatomy.scale[2]), p)
    sheets.diaphragm()
    sheets.crura(skeleton.body["T9-T12"])
    manubrium, spine = anatomy.sternum_back[0], anatomy.front["T4"]
    sheets.mediastinum(
        {skeleton.body["sternum"]: manubrium, skeleton.body[segment_of("T4")]: spine}
    )
    sheets.wall()
    links = build_links(points, skeleton, anatomy, p)
    plant = _pack(points, skeleton, cavity, muscles, tissue, links, hung, subject, p)
    outer = orient_tube(points, cavity, plant)
    return Torso(
        subject=subject,
        parameters=p,
        anatomy=anatomy,
        skeleton=skeleton,
        plant=plant,
        places=points.places(),
        diaphragm=points.resolve(cavity.diaphragm),
        wall=points.resolve(cavity.wall),
        n_dome=len(cavity.diaphragm_faces),
        outer=outer,
        rows=[[points.resolve(row) for row in side] for side in cavity.rows],
    )


def orient_tube(points: Points, cavity: Cavity, plant: Plant) -> Ints:
    """Outward faces of rib cage and belly without diaphragm, for the skin side."""
    dome = {tuple(sorted(f)) for f in points.resolve(cavity.diaphragm_faces).tolist()}
    both = np.vstack([plant.chest_faces, plant.abdomen_faces])
    keep = [tuple(sorted(f)) not in dome for f in both.tolist()]
    return np.asarray(both[keep])


def _masses(cavity: Cavity, n: int, p: Parameters) -> tuple[Floats, Floats]:
    if p["equal_point_masses"]:
        return np.full(n, p["wall_inertia"] / n), np.full(n, p["wall_weight"] / n)
    dome = np.zeros(n, dtype=bool)
    dome[[-h - 1 for column in cavity.diaphragm for h in column if h < 0]] = True
    inertia = np.where(dome, p["diaphragm_inertia"] / dome.sum(), p["wall_inertia"] / (~dome).sum())
    weight = np.where(dome, p["diaphragm_weight"] / dome.sum(), p["wall_weight"] / (~dome).sum())
    return inertia, weight


def _constants(subject: Subject, p: Parameters, chest: float, belly: float) -> Constants:
    lung = lung_capacity(subject)
    recoil = np.exp(p["lung_rate"] * p["end_expiratory_pleural"])
    total = np.exp(-p["lung_rate"] * p["total_recoil"])
    scale = (lung["tlc"] - lung["frc"]) / (recoil - total)
    return Constants(
        law=HILL,
        width=p["hill_width"],
        curvature=p["hill_curvature"],
        eccentric=p["eccentric_force"],
        recruited=p["recruited_from"],
        contact_gap=p["contact_gap"],
        contact_stiffness=p["contact_stiffness"],
        contact_damping=p["contact_damping"],
        abdomen_volume=belly,
        bulk_modulus=p["bulk_modulus"],
        content_density=p["content_density"],
        no_suction=bool(p["no_suction"]),
        tissue_volume=chest - lung["frc"],
        lung_limit=lung["frc"] + scale * recoil,
        lung_scale=scale,
        lung_rate=p["lung_rate"],
        atmosphere=p["atmosphere"],
        airway_k1=p["airway_k1"],
        airway_k2=p["airway_k2"],
        residual_volume=lung["rv"],
        total_capacity=lung["tlc"],
        peak_flow=lung["pef"],
    )


def _pack(
    points: Points,
    skeleton: Skeleton,
    cavity: Cavity,
    muscles: MuscleList,
    tissue: TissueList,
    links: Links,
    hung: tuple[list[int], list[float]],
    subject: Subject,
    p: Parameters,
) -> Plant:
    x, n_bound, n = points.places(), len(points.bound), len(points.free)
    chest = points.resolve([*cavity.sheet_faces, *cavity.diaphragm_faces])
    belly = points.resolve([*cavity.belly_faces, *cavity.diaphragm_faces])
    chest, belly = orient(x, chest), orient(x, belly)
    ends = points.resolve([muscles.a + tissue.a, muscles.b + tissue.b])
    both = (ends >= n_bound).all(axis=0)
    edges = np.unique(np.sort(ends[:, both], axis=0), axis=1).T
    pattern = analyse(n, edges - n_bound)
    place = {tuple(sorted((int(pattern.order[i]), int(pattern.order[j])))): s
             for s, (i, j) in enumerate(pattern.pair)}  # fmt: skip
    slots = {(a, b): place[a - n_bound, b - n_bound] for a, b in edges.tolist()}
    body = np.array(points.body, dtype=np.int64)
    sheet = off_the_spine(chest[: len(cavity.sheet_faces)], body, spine_bodies(skeleton.body))
    dome = [h for column in cavity.diaphragm for h in column if h < 0]
    inertia, weight = _masses(cavity, n, p)
    data = mujoco.MjData(skeleton.model)
    mujoco.mj_kinematics(skeleton.model, data)
    return Plant(
        tree=skeleton.tree,
        joints=skeleton.joints,
        muscles=pack_muscles(points, muscles, slots, subject.sex, p),
        tissue=pack_tissue(points, tissue, slots),
        links=links,
        contacts=build_contacts(x, points.resolve(dome), sheet, p["torso_axis"]),
        constants=_constants(subject, p, enclosed_volume(x, chest), enclosed_volume(x, belly)),
        pattern=pattern,
        point_body=body,
        point_local=x[:n_bound] - data.xpos[body],
        particle_inertia=inertia,
        particle_weight=weight,
        carried=points.resolve(hung[0]),
        carried_mass=np.array(hung[1]),
        chest_faces=chest,
        abdomen_faces=belly,
        reference=np.array([0.0, 0.0, x[points.resolve(cavity.diaphragm)[0, 0], 2]]),
    )
