"""When the step's matrix is too old, and what the diaphragm may touch."""

from __future__ import annotations

import numpy as np
import pytest

from sim.model.skeleton import spine_bodies
from sim.physics.age import REACH, differs, keep_lines, loosest, stiffened, touched
from sim.physics.contact import cross_sheet
from sim.physics.forces import add_tissue, stiffest_soon
from sim.physics.work import make_work
from sim.resting import RestingTorso

ALONG, ACROSS = 1.5, 0.02


def turned(resting: RestingTorso, angle: float) -> tuple[float, float]:
    """What `loosest` says after all points turned by an angle about Y, and what it should say."""
    plant, x = resting.torso.plant, np.ascontiguousarray(resting.upright.points)
    work, n = make_work(plant), len(plant.muscles.a)
    along, across = np.full(n, ALONG), np.full(n, ACROSS)
    keep_lines(x, plant.muscles, plant.particle_inertia, along, across, work.known)
    c, s = np.cos(angle), np.sin(angle)
    there = np.ascontiguousarray(x @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]))
    cosine = (work.known.direction * (there[plant.muscles.b] - there[plant.muscles.a])).sum(axis=1)
    cosine /= np.linalg.norm(there[plant.muscles.b] - there[plant.muscles.a], axis=1)
    return loosest(there, plant.muscles, work.known), float(
        (work.known.grip * (1.0 - cosine**2)).max()
    )


def test_a_fibre_that_has_not_turned_is_held(resting: RestingTorso) -> None:
    assert turned(resting, 0.0)[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("angle", [0.02, 0.1, 0.5])
def test_hold_is_lost_with_the_square_of_the_sine(resting: RestingTorso, angle: float) -> None:
    plant = resting.torso.plant
    found, direct = turned(resting, angle)
    assert found == pytest.approx(direct)
    # fibres of the flanks lie in the plane of the turn: they feel all of it
    lightest = ALONG / (plant.particle_inertia.min() + ACROSS)
    assert 0.9 * np.sin(angle) ** 2 * lightest < found <= np.sin(angle) ** 2 * lightest * (1 + 1e-9)


def test_elements_between_bones_are_not_asked(resting: RestingTorso) -> None:
    plant = resting.torso.plant
    work, n = make_work(plant), len(plant.muscles.a)
    x = np.ascontiguousarray(resting.upright.points)
    keep_lines(
        x, plant.muscles, plant.particle_inertia, np.full(n, ALONG), np.full(n, ACROSS), work.known
    )
    bones = np.maximum(plant.muscles.a, plant.muscles.b) < resting.torso.n_bound
    assert bones.any() and (work.known.grip[bones] == 0.0).all()
    assert (work.known.grip[~bones] > 0.0).all()


def test_stiffer_threads_new_contacts_and_more_activation_age_the_matrix(
    resting: RestingTorso,
) -> None:
    work = make_work(resting.torso.plant)
    work.known.slope[:] = 10.0
    work.strings.slope[:] = 10.0
    work.gap[:] = 0.5 * REACH
    work.known.touching[:] = True
    work.known.activation[:] = 0.3
    level = np.full(len(work.known.activation), 0.3)
    assert not stiffened(work.strings, work.known)
    assert not touched(work.gap, work.known)
    assert not differs(level, work.known)
    work.strings.slope[7] *= 1.01
    work.known.touching[3] = False
    assert stiffened(work.strings, work.known)
    assert touched(work.gap, work.known)
    work.gap[3] = 1.5 * REACH
    assert not touched(work.gap, work.known)
    for other, old in ((0.45, True), (0.39, False), (0.16, False), (0.12, True)):
        level[2] = other
        assert differs(level, work.known) == old


def test_a_stretching_thread_is_held_as_stiff_as_it_will_be(resting: RestingTorso) -> None:
    plant = resting.torso.plant
    tissue, work, ahead = plant.tissue, make_work(plant), 0.02
    x = np.ascontiguousarray(resting.upright.points)
    about = x.mean(axis=0)
    v = 0.5 * (x - about)  # everything grows by a hundredth in 20 ms
    add_tissue(x, v, tissue, work.strings, work.f)
    now, soon = work.strings.slope.copy(), np.empty(len(tissue.a))
    stiffest_soon(tissue, work.strings, ahead, soon)
    add_tissue(x + ahead * v, v, tissue, work.strings, work.f)
    assert soon == pytest.approx(work.strings.slope, rel=1e-6)
    assert (soon / now).max() > 1.05
    work.strings.slope[:], work.strings.rate[:] = now, -work.strings.rate
    stiffest_soon(tissue, work.strings, ahead, soon)
    assert np.array_equal(soon, now)


def test_the_diaphragm_does_not_touch_vertebrae(resting: RestingTorso) -> None:
    torso = resting.torso
    spine = spine_bodies(torso.skeleton.body)
    faces = torso.plant.contacts.face
    assert not np.isin(torso.plant.point_body[faces], sorted(spine)).all(axis=1).any()
    assert len(torso.plant.chest_faces) - torso.n_dome > len(faces)


def test_a_face_behind_the_axis_is_not_seen() -> None:
    x = np.array([[-0.1, -0.1, -0.1], [-0.1, 0.1, -0.1], [-0.1, 0.0, 0.2], [0.05, 0.0, 0.0]])
    weight, normal = np.zeros(3), np.zeros(3)
    for face in ([0, 1, 2], [0, 2, 1]):
        one = np.array([face], dtype=np.int64)
        assert cross_sheet(x, one, 0, 3, 0.0, np.zeros_like(x), weight, normal)[1] < -1.0
