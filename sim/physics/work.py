"""Scratch of one run: what the kernels write between two states."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.physics.coupling import Coupling, make_coupling
from sim.physics.plant import Plant
from sim.physics.rigid import Riders, find_riders
from sim.physics.types import Bools, Floats, Ints


class Fibres(NamedTuple):
    """The muscle elements as they are now, and the fibres that they form."""

    length: Floats
    rate: Floats
    tension: Floats
    """(n_elements,), m, m/s and N"""
    span: Floats
    speed: Floats
    """(n_chains,), m and m/s, length and lengthening of the whole fibre"""
    factor: Floats
    """(n_chains,), force-length times force-velocity"""


class Strings(NamedTuple):
    """The passive threads as they are now."""

    length: Floats
    rate: Floats
    tension: Floats
    """(n_threads,), m, m/s and N; negative where a thread pushes"""
    slope: Floats
    """(n_threads,), N/m"""


class Matrix(NamedTuple):
    """The step's matrix and its factors."""

    diagonal: Floats
    off: Floats
    """(n_particles, 3, 3) and (n_pairs, 3, 3), kg, blocks of the particles"""
    lower: Floats
    inverse: Floats
    scratch: Floats
    rigid: Floats
    rigid_inverse: Floats
    """(n_dof, n_dof), kg or kg m^2, block of the bodies, and the inverse of its factor"""
    rigid_scratch: Floats
    pairs: Floats
    """(n_bodies, n_bodies, 6, 6), kg, between a later and an earlier body"""
    joined: Floats
    """(n_bodies, n_bodies), not zero where there is such a block"""
    wrench: Floats
    coupling: Coupling
    belly: Floats
    chest: Floats
    """(n_dof + 3 n_particles,), gradients of the two volumes"""
    belly_solved: Floats
    chest_solved: Floats


class Known(NamedTuple):
    """What the matrix was built with, see `sim.physics.age`."""

    direction: Floats
    """(n_elements, 3), unit"""
    grip: Floats
    """(n_elements,), what resists along the line over what resists across; 0 between bodies"""
    slope: Floats
    """(n_threads,), N/m, up to which a thread may stiffen"""
    touching: Bools
    """(n_contacts,)"""
    activation: Floats
    """(n_groups,)"""


class Work(NamedTuple):
    """Scratch of one run."""

    x: Floats
    v: Floats
    f: Floats
    """(n_points, 3), m, m/s and N"""
    tau: Floats
    bias: Floats
    wrench: Floats
    change: Floats
    """(n_dof + 3 n_particles,), impulse, then change of velocity"""
    gap: Floats
    held: Ints
    """(n_contacts,), m, and face beside each particle"""
    ease: Floats
    """(n_contacts,), share of its push that a contact has"""
    sheet_normal: Floats
    """(n_points, 3), at the points of the sheet that the diaphragm slides on"""
    chest_normal: Floats
    abdomen_normal: Floats
    riders: Riders
    fibres: Fibres
    strings: Strings
    known: Known
    matrix: Matrix


def make_work(plant: Plant) -> Work:
    """Allocate the scratch of one run."""
    n_dof, n_particles = len(plant.tree.dof_body), len(plant.particle_inertia)
    n_points = len(plant.point_body) + n_particles
    n_elements, n_chains = len(plant.muscles.a), len(plant.muscles.chain_rest)
    size, n_groups = n_dof + 3 * n_particles, int(plant.muscles.group.max()) + 1
    return Work(
        x=np.zeros((n_points, 3)),
        v=np.zeros((n_points, 3)),
        f=np.zeros((n_points, 3)),
        tau=np.zeros(n_dof),
        bias=np.zeros(n_dof),
        wrench=np.zeros((len(plant.tree.body_root), 6)),
        change=np.zeros(size),
        gap=np.zeros(len(plant.contacts.point)),
        held=plant.contacts.start.copy(),
        ease=np.ones(len(plant.contacts.point)),
        sheet_normal=np.zeros((n_points, 3)),
        chest_normal=np.zeros((len(plant.chest_faces), 3)),
        abdomen_normal=np.zeros((len(plant.abdomen_faces), 3)),
        riders=find_riders(plant.point_body, len(plant.tree.body_root)),
        fibres=Fibres(*np.zeros((3, n_elements)), *np.zeros((3, n_chains))),
        strings=Strings(*np.zeros((4, len(plant.tissue.a)))),
        known=Known(
            direction=np.zeros((n_elements, 3)),
            grip=np.zeros(n_elements),
            slope=np.zeros(len(plant.tissue.a)),
            touching=np.zeros(len(plant.contacts.point), dtype=np.bool_),
            activation=np.zeros(n_groups),
        ),
        matrix=_make_matrix(plant, n_dof, n_particles),
    )


def _make_matrix(plant: Plant, n_dof: int, n_particles: int) -> Matrix:
    n_bodies, size = len(plant.tree.body_root), n_dof + 3 * n_particles
    return Matrix(
        diagonal=np.zeros((n_particles, 3, 3)),
        off=np.zeros((len(plant.pattern.pair), 3, 3)),
        lower=np.zeros((len(plant.pattern.row), 3, 3)),
        inverse=np.zeros((n_particles, 3, 3)),
        scratch=np.zeros((n_particles, 3)),
        rigid=np.zeros((n_dof, n_dof)),
        rigid_inverse=np.zeros((n_dof, n_dof)),
        rigid_scratch=np.zeros(n_dof),
        pairs=np.zeros((n_bodies, n_bodies, 6, 6)),
        joined=np.zeros((n_bodies, n_bodies)),
        wrench=np.zeros((n_bodies, 6, n_dof)),
        coupling=make_coupling(plant, n_dof),
        belly=np.zeros(size),
        chest=np.zeros(size),
        belly_solved=np.zeros(size),
        chest_solved=np.zeros(size),
    )
