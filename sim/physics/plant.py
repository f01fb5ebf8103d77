"""The torso as flat arrays: what the compiled step loop reads."""

from __future__ import annotations

from typing import NamedTuple

from sim.physics.blocks import Pattern
from sim.physics.types import Floats, Ints


class Tree(NamedTuple):
    """Rigid bodies as the engine of rigid bodies numbers them."""

    body_root: Ints
    """(n_bodies,), body at the root of each kinematic tree"""
    body_parent: Ints
    body_last_dof: Ints
    """(n_bodies,), last degree of freedom that moves the body, -1 if none"""
    dof_body: Ints
    dof_parent: Ints
    m_start: Ints
    m_count: Ints
    m_column: Ints


class Joints(NamedTuple):
    """Elastic ball joints and hinges."""

    ball_dof: Ints
    ball_qpos: Ints
    ball_stiffness: Floats
    """(n, 3, 3), N m/rad, in the parent's frame"""
    ball_damping: Floats
    """(n, 3, 3), N m s/rad"""
    ball_rest: Floats
    """(n, 3), rotation vector at which the joint is slack"""
    ball_limit: Floats
    """(n, 6), largest +-x, +-y, +-z rotation, rad; x1 y1 z1 x2 y2 z2"""
    limit_stiffness: Floats
    """(n,), N m/rad, added beyond a limit"""
    hinge_dof: Ints
    hinge_qpos: Ints
    hinge_stiffness: Floats
    hinge_damping: Floats
    hinge_rest: Floats


class Muscles(NamedTuple):
    """Muscle elements; the elements of one chain act as one fibre."""

    a: Ints
    b: Ints
    group: Ints
    chain: Ints
    slot: Ints
    """matrix block of the pair, -1 unless both ends are particles"""
    share: Floats
    """neural drive of an element over that of its group"""
    late: Floats
    """what comes on top of `share` in a maximal effort"""
    rest: Floats
    """optimal length, m (spring law: rest length)"""
    f_max: Floats
    """N (spring law: active stiffness, N/m)"""
    k_pe: Floats
    """N (spring law: N/m)"""
    b_pe: Floats
    """N s (spring law: N s/m)"""
    chain_rest: Floats
    chain_count: Floats
    chain_v_max: Floats
    """1/s (spring law: contraction ratio)"""


class Tissue(NamedTuple):
    """Passive threads: a wall's only pull, those of the diaphragm hold their length both ways."""

    a: Ints
    b: Ints
    slot: Ints
    rest: Floats
    stiffness: Floats
    damping: Floats
    pushes: Ints
    """1 where a thread also resists shortening"""
    curve: Floats
    """how fast a thread stiffens: by e^curve at a strain of one; 0 for a straight line"""


class Links(NamedTuple):
    """Springs of no length from a rib (a) to its cartilage (b), softer along the cartilage."""

    a: Ints
    b: Ints
    axis: Floats
    """(n, 3), unit, along the cartilage in the frame of the body of b"""
    along: Floats
    across: Floats
    """(n,), N/m"""
    damping: Floats


class Contacts(NamedTuple):
    """Diaphragm particles that slide on the inner sheet of the rib cage."""

    point: Ints
    face: Ints
    """(n_sheet_faces, 3), turned so that the normal looks out of the chest"""
    corner: Ints
    """(n_corners,), all points of the faces"""
    neighbour: Ints
    """(n_sheet_faces, k), faces that share a vertex, -1 padded"""
    start: Ints
    """(n_contacts,), face beside each particle as built"""
    axis: float
    """X of the vertical axis that the gap is measured from, m"""


class Constants(NamedTuple):
    """Scalars; `sim/data/parameters.csv` has each one's unit and source."""

    law: int
    width: float
    curvature: float
    eccentric: float
    recruited: float
    contact_gap: float
    contact_stiffness: float
    contact_damping: float
    abdomen_volume: float
    bulk_modulus: float
    content_density: float
    no_suction: bool
    tissue_volume: float
    lung_limit: float
    lung_scale: float
    lung_rate: float
    atmosphere: float
    airway_k1: float
    airway_k2: float
    residual_volume: float
    total_capacity: float
    peak_flow: float


class Plant(NamedTuple):
    """Everything that does not change during a run."""

    tree: Tree
    joints: Joints
    muscles: Muscles
    tissue: Tissue
    links: Links
    contacts: Contacts
    constants: Constants
    pattern: Pattern
    point_body: Ints
    point_local: Floats
    """(n_bound, 3), m, in the frame of the body; particles follow the bound points"""
    particle_inertia: Floats
    particle_weight: Floats
    """(n_particles,), kg that moves and kg that weighs"""
    carried: Ints
    carried_mass: Floats
    """(n,), points at which a weight is carried by what is not modelled, and the masses, kg"""
    chest_faces: Ints
    abdomen_faces: Ints
    reference: Floats
    """(3,), point at which the abdominal pressure is stated"""
