"""Muscles, tissue, links and contact: every pull has its counterpull."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim import engine
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.contact import add_contacts, cross_sheet, follow_sheet
from sim.physics.forces import add_links, add_muscles, add_tissue
from sim.physics.muscle import HILL, SPRING
from sim.physics.plant import Contacts
from sim.physics.types import Floats
from sim.rest import Machine
from sim.resting import RestingTorso


def ring(n: int = 12, rows: int = 4, radius: float = 0.1) -> tuple[Floats, Contacts]:
    """A cylinder about the vertical axis, faces outwards, and one particle inside it."""
    angle = 2.0 * np.pi * np.arange(n) / n
    points = [
        [radius * np.cos(t), radius * np.sin(t), 0.05 * k] for k in range(rows) for t in angle
    ]
    faces = []
    for k in range(rows - 1):
        for j in range(n):
            a, b = k * n + j, k * n + (j + 1) % n
            faces += [(a, b, b + n), (a, b + n, a + n)]
    face = np.array(faces, dtype=np.int64)
    near = [[g for g in range(len(face)) if g != f and set(face[g]) & set(face[f])]
            for f in range(len(face))]  # fmt: skip
    neighbour = np.full((len(face), max(map(len, near)) + 1), -1, dtype=np.int64)
    for f, row in enumerate(near):
        neighbour[f, : len(row)] = row
    contacts = Contacts(
        point=np.array([len(points)]), face=face, corner=np.unique(face), neighbour=neighbour,
        start=np.zeros(1, dtype=np.int64), axis=0.0,
    )  # fmt: skip
    return np.array([*points, [0.05, 0.0, 0.02]]), contacts


def held_by(x: Floats, contacts: Contacts, normals: Floats | None = None) -> np.ndarray:
    held = contacts.start.copy()
    follow_sheet(
        x, contacts, held, np.ones(1), 1.0, np.zeros_like(x) if normals is None else normals
    )
    return held


@pytest.mark.parametrize("inside", [0.02, 0.001, -0.001, -0.01])
def test_gap_is_positive_inside_and_negative_outside(inside: float) -> None:
    x, contacts = ring()
    middle = 2.0 * np.pi * 0.5 / 12.0
    flat = 0.1 * np.cos(middle)
    # between inner corners, whose faces are alike on all sides
    x[-1] = [(flat - inside) * np.cos(middle), (flat - inside) * np.sin(middle), 0.07]
    weight, normal, normals = np.zeros(3), np.zeros(3), np.zeros_like(x)
    contacts = contacts._replace(start=np.array([24], dtype=np.int64))
    held = held_by(x, contacts, normals)[0]
    face = contacts.face[held]
    gap, least = cross_sheet(x, contacts.face, held, len(x) - 1, 0.0, normals, weight, normal)
    assert gap == pytest.approx(inside, abs=1e-12)
    assert least >= 0.0
    assert weight.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(normal, [-np.cos(middle), -np.sin(middle), 0.0], atol=1e-12)
    crossing = weight @ x[face]
    np.testing.assert_allclose(np.cross(crossing, x[-1])[2], 0.0, atol=1e-12)


@given(
    st.floats(0.0, 2.0 * np.pi), st.floats(0.001, 0.149), st.floats(0.02, 0.096),
    st.integers(0, 2), st.integers(-2, 2),
)  # fmt: skip
def test_walk_ends_on_the_face_that_the_ray_crosses(
    angle: float, height: float, radius: float, row: int, aside: int
) -> None:
    x, contacts = ring()
    x[-1] = [radius * np.cos(angle), radius * np.sin(angle), height]
    # the walk is never far from its goal in a run: begin within two columns, in any row
    column = int(angle / (2.0 * np.pi / 12.0)) % 12
    start = 24 * row + 2 * ((column + aside) % 12)
    contacts = contacts._replace(start=np.array([start], dtype=np.int64))
    weight, normal = np.zeros(3), np.zeros(3)
    g, normals = held_by(x, contacts)[0], np.zeros_like(x)
    assert cross_sheet(x, contacts.face, g, len(x) - 1, 0.0, normals, weight, normal)[1] >= -1e-9


def test_gap_has_no_jump_from_face_to_face() -> None:
    x, contacts = ring()
    held, gaps = contacts.start.copy(), []
    weight, normal, normals = np.zeros(3), np.zeros(3), np.zeros_like(x)
    for angle in np.linspace(0.0, 2.0 * np.pi, 721):
        x[-1] = [0.09 * np.cos(angle), 0.09 * np.sin(angle), 0.06]
        follow_sheet(x, contacts, held, np.ones(1), 1.0, normals)
        crossed = cross_sheet(x, contacts.face, held[0], len(x) - 1, 0.0, normals, weight, normal)
        gaps.append(crossed[0])
    # along an arc of half a degree the gap to a face of a cylinder changes by 0.2 mm at most
    assert np.abs(np.diff(gaps)).max() < 0.0003


def test_push_has_no_jump_from_face_to_face() -> None:
    x, contacts = ring()
    weight, normal, normals = np.zeros(3), np.zeros(3), np.zeros_like(x)
    held, found = contacts.start.copy(), []
    for angle in np.linspace(0.0, 2.0 * np.pi, 721):
        x[-1] = [0.09 * np.cos(angle), 0.09 * np.sin(angle), 0.06]
        follow_sheet(x, contacts, held, np.ones(1), 1.0, normals)
        cross_sheet(x, contacts.face, held[0], len(x) - 1, 0.0, normals, weight, normal)
        found.append(normal.copy())
    # the faces of the cylinder meet at 30 degrees; along half a degree the normal turns as much
    step = np.linalg.norm(np.diff(found, axis=0), axis=1)
    assert step.max() < 1.5 * np.radians(0.5)
    assert step.sum() == pytest.approx(2.0 * np.pi, rel=0.02)


def contact_force(resting: RestingTorso, x: Floats, v: Floats) -> tuple[Floats, Floats]:
    plant = resting.torso.plant
    held = plant.contacts.start.copy()
    gap, f, normals = np.zeros(len(held)), np.zeros_like(x), np.zeros_like(x)
    follow_sheet(x, plant.contacts, held, np.ones(len(held)), 1.0, normals)
    add_contacts(x, v, plant.contacts, plant.constants, held, np.ones(len(held)), normals, gap, f)
    return f, gap


def test_contact_gives_and_takes_the_same_force(resting: RestingTorso) -> None:
    x = resting.upright.points.copy()
    rng = np.random.default_rng(1)
    x[resting.torso.n_bound :] += 0.002 * rng.standard_normal((resting.torso.n_particles, 3))
    f, gap = contact_force(resting, x, np.zeros_like(x))
    assert (gap < resting.torso.plant.constants.contact_gap).sum() > 20
    assert np.abs(f).sum() > 10.0
    np.testing.assert_allclose(f.sum(axis=0), 0.0, atol=1e-11 * np.abs(f).sum())


def test_contact_never_pulls(resting: RestingTorso) -> None:
    plant = resting.torso.plant
    x = resting.upright.points.copy()
    for seed in range(3):
        v = 0.5 * np.random.default_rng(seed).standard_normal(x.shape)
        f, gap = contact_force(resting, x, v)
        far = gap > plant.constants.contact_gap
        assert not f[plant.contacts.point[far]].any()
        middle = np.array([plant.contacts.axis, 0.0])
        inward = middle - x[plant.contacts.point, :2]
        push = (f[plant.contacts.point, :2] * inward).sum(axis=1)
        assert push.min() >= -1e-12


def test_every_point_of_the_zone_of_apposition_is_inside_at_rest(resting: RestingTorso) -> None:
    x = resting.upright.points
    _, gap = contact_force(resting, x, np.zeros_like(x))
    assert gap.min() > 0.0


def internal_forces(resting: RestingTorso, seed: int, law: int) -> tuple[Floats, ...]:
    """Random motion about rest: places, and forces of muscles, tissue and links."""
    plant = resting.torso.plant
    rng = np.random.default_rng(seed)
    x = resting.upright.points + 0.003 * rng.standard_normal(resting.upright.points.shape)
    v = 0.05 * rng.standard_normal(x.shape)
    constants = plant.constants._replace(law=law)
    machine, out = Machine(resting.torso), []
    fibres, strings = machine.work.fibres, machine.work.strings
    f = np.zeros_like(x)
    level = rng.uniform(0.0, 1.0, len(MUSCLE_GROUPS))
    add_muscles(x, v, plant.muscles, constants, level, fibres, f)
    out.append(f)
    f = np.zeros_like(x)
    add_tissue(x, v, plant.tissue, strings, f)
    out.append(f)
    f = np.zeros_like(x)
    engine.predict(machine.bones, plant, machine.work, resting.upright.state, 0.0)
    add_links(x, v, plant.links, plant.point_body, machine.bones.rotation, f)
    out.append(f)
    return x, fibres.tension, strings.tension, *out


@pytest.mark.parametrize("law", [HILL, SPRING])
@pytest.mark.parametrize("seed", [1, 2])
def test_internal_forces_cancel(resting: RestingTorso, seed: int, law: int) -> None:
    x, tension, pull, muscles, tissue, links = internal_forces(resting, seed, law)
    assert tension.min() >= 0.0
    assert pull[resting.torso.plant.tissue.pushes == 0].min() >= 0.0
    for f in (muscles, tissue, links):
        size = np.abs(f).sum()
        assert size > 1.0
        np.testing.assert_allclose(f.sum(axis=0), 0.0, atol=1e-12 * size)
    for f in (muscles, tissue):
        moment = np.cross(x, f).sum(axis=0)
        np.testing.assert_allclose(moment, 0.0, atol=1e-12 * np.abs(f).sum())


def test_a_fibre_has_one_active_tension(resting: RestingTorso) -> None:
    # elements of a diaphragm fibre share the fibre's factors, so they differ by the passive part
    plant = resting.torso.plant
    m = plant.muscles._replace(k_pe=np.zeros_like(plant.muscles.k_pe),
                               b_pe=np.zeros_like(plant.muscles.b_pe))  # fmt: skip
    x = resting.upright.points
    fibres, still = Machine(resting.torso).work.fibres, np.zeros_like(x)
    level = np.ones(len(MUSCLE_GROUPS))
    add_muscles(x, still, m, plant.constants, level, fibres, np.zeros_like(x))
    diaphragm = m.group == MUSCLE_GROUPS.index("diaphragm")
    for chain in np.unique(m.chain[diaphragm]):
        pull = fibres.tension[m.chain == chain]
        assert len(pull) > 5
        assert np.ptp(pull) < 1e-9 * pull.max()
        assert pull.min() > 0.0


def test_a_particle_keeps_to_its_layer_where_the_sheet_is_folded() -> None:
    # two faces that share an edge, the second turned back in front of the first
    x = np.array([
        [0.10, -0.05, 0.0], [0.10, 0.05, 0.0], [0.10, 0.0, 0.05], [0.08, 0.0, -0.03],
        [0.099, 0.0, 0.001],
    ])  # fmt: skip
    face = np.array([[0, 1, 2], [1, 0, 3]], dtype=np.int64)
    contacts = Contacts(
        point=np.array([4]), face=face, corner=np.unique(face), start=np.zeros(1, dtype=np.int64),
        neighbour=np.array([[1, -1], [0, -1]]), axis=0.0,
    )  # fmt: skip
    held, ease = held_by(x, contacts), np.ones(1)
    assert held[0] == 0
    for z in (-0.005, -0.01):
        x[4, 2] = z
        follow_sheet(x, contacts, held, ease, 0.1, np.zeros_like(x))
        assert held[0] == 0 and ease[0] == 1.0, z
    # out of touch it takes the other layer, which takes hold of it in ten steps
    x[4, 2] = -0.02
    follow_sheet(x, contacts, held, ease, 0.1, np.zeros_like(x))
    assert held[0] == 1 and ease[0] == 0.0
    for k in range(1, 12):
        follow_sheet(x, contacts, held, ease, 0.1, np.zeros_like(x))
        assert ease[0] == pytest.approx(min(1.0, 0.1 * k))
    # what it is just behind, or in front of, it goes over to at once
    held[0], x[4, 0] = 0, 0.1 - 0.02 * 2.0 / 3.0 + 0.001
    follow_sheet(x, contacts, held, ease, 0.1, np.zeros_like(x))
    assert held[0] == 1 and ease[0] == 1.0
