"""The built torso: what it is made of and its size."""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np
import pytest

from sim.errors import ParameterError
from sim.model.anatomy import SIDES
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.skeleton import SEGMENTS, body_masses
from sim.model.torso import Subject, Torso, build_torso, lung_capacity
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats, Ints
from sim.tables import body_size, column, parameters, read_rows

MAN = Subject(sex="male", stature=1.756, mass=75.0)


@pytest.fixture(scope="module")
def torso() -> Torso:
    return build_torso(MAN)


def elements(torso: Torso, group: str) -> Ints:
    return np.flatnonzero(torso.plant.muscles.group == MUSCLE_GROUPS.index(group))


def test_it_is_as_large_as_asked(torso: Torso) -> None:
    assert len(torso.plant.muscles.a) > 1000
    assert torso.skeleton.model.nbody - 1 > 35
    assert torso.n_particles > 300
    layers = ("external_intercostals", "internal_intercostals")
    assert sum(len(elements(torso, g)) for g in layers) >= 500
    assert all(len(elements(torso, g)) > 0 for g in MUSCLE_GROUPS)


def test_joints_are_those_of_table_8_2(torso: Torso) -> None:
    model, kind = torso.skeleton.model, mujoco.mjtJoint
    for name in (*SEGMENTS, "skull", *(f"rib_{s}{i}" for s in SIDES for i in range(1, 13))):
        assert model.body(name).jntnum[0] == 1
        assert model.jnt_type[model.body(name).jntadr[0]] == kind.mjJNT_BALL
    for side in SIDES:
        for part in ("2", "3", "4", "5", "6-10"):
            body = model.body(f"cartilage_{side}{part}")
            assert model.body(int(body.parentid[0])).name == "sternum"
            # a universal joint: two hinges at right angles
            assert body.jntnum[0] == 2
            first = int(body.jntadr[0])
            assert set(model.jnt_type[first : first + 2]) == {int(kind.mjJNT_HINGE)}
            axes = model.jnt_axis[first : first + 2]
            assert axes[0] @ axes[1] == pytest.approx(0.0, abs=1e-9)
    assert model.body("L4-L5").parentid[0] == 0


def test_spine_is_a_chain_on_the_pelvis(torso: Torso) -> None:
    model = torso.skeleton.model
    names = ["skull", "C1-C3", "C4-C7", "T1-T4", "T5-T8", "T9-T12", "L1-L3", "L4-L5"]
    for upper, lower in pairwise(names):
        assert model.body(int(model.body(upper).parentid[0])).name == lower


def test_masses_are_those_of_the_table(torso: Torso) -> None:
    model, wanted = torso.skeleton.model, body_masses(MAN, parameters())
    ribs = [f"rib_{s}{i}" for s in SIDES for i in range(1, 13)]
    assert sum(model.body(r).mass[0] for r in ribs) == pytest.approx(wanted["ribs"])
    for name in (*SEGMENTS, "skull", "sternum"):
        assert model.body(name).mass[0] == pytest.approx(wanted[name])
    assert (model.body_mass[1:] > 0.0).all()
    assert (model.body_inertia[1:] > 0.0).all()
    # the parts of the upper trunk do not weigh more than it does
    p = parameters()
    shares = column(read_rows("masses.csv"), "share").sum()
    shares += p["girdle_share"] / p["upper_trunk_share"]
    assert 0.85 < shares <= 1.05
    heavy = build_torso(Subject(sex="male", stature=1.756, mass=90.0)).skeleton.model
    assert heavy.body_mass[1:].sum() > model.body_mass[1:].sum()


def test_particles_have_mass(torso: Torso) -> None:
    p = torso.parameters
    assert (torso.plant.particle_inertia > 0.0).all()
    assert (torso.plant.particle_weight > 0.0).all()
    total = p["wall_inertia"] + p["diaphragm_inertia"]
    assert torso.plant.particle_inertia.sum() == pytest.approx(total)
    weight = p["wall_weight"] + p["diaphragm_weight"]
    assert torso.plant.particle_weight.sum() == pytest.approx(weight)


def test_dilorenzo_table_8_2_gives_the_masses_of_papers() -> None:
    printed = {row["part"]: float(row["mass_kg"]) for row in read_rows("bodies.csv")}
    model = build_torso(MAN, parameters=parameters("papers")).skeleton.model
    for name in (*SEGMENTS, "skull", "sternum"):
        assert model.body(name).mass[0] == printed[name]
    for side in SIDES:
        assert [model.body(f"rib_{side}{i}").mass[0] for i in range(1, 13)] == pytest.approx(
            [0.7] * 12
        )
        for part in ("2", "3", "4", "5", "6-10"):
            assert model.body(f"cartilage_{side}{part}").mass[0] == printed[f"cartilage_{part}"]
        assert model.body(f"girdle_{side}").mass[0] == 3.43


def test_dilorenzo_section_3_2_3_every_element_is_a_muscle_in_papers(torso: Torso) -> None:
    muscles = build_torso(MAN, parameters=parameters("papers")).plant.muscles
    assert (muscles.chain_count == 1.0).all()
    np.testing.assert_allclose(muscles.chain_rest[muscles.chain], muscles.rest)
    assert torso.plant.muscles.chain_count.max() > 5.0


def test_dilorenzo_section_3_2_all_points_of_the_abdomen_are_alike() -> None:
    torso = build_torso(MAN, parameters=parameters("papers"))
    body = torso.skeleton.body["central_tendon"]
    tendon = torso.skeleton.model.body_mass[body]
    every = np.unique(np.vstack([torso.plant.abdomen_faces, torso.plant.chest_faces]))
    on_tendon = every[every < torso.n_bound]
    count = int((torso.plant.point_body[on_tendon] == body).sum())
    inertia = torso.plant.particle_inertia
    assert inertia.sum() + tendon == pytest.approx(8.0)
    np.testing.assert_allclose(inertia, tendon / count, rtol=1e-3)
    # forces on them are those of muscles and pressure: no weight
    assert not torso.plant.particle_weight.any()
    assert torso.plant.carried_mass[-1] == pytest.approx(tendon)


def closed(faces: Ints) -> bool:
    """Every edge runs once each way."""
    edges = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forth = {tuple(e) for e in edges.tolist()}
    return len(forth) == len(edges) and forth == {(b, a) for a, b in forth}


def test_cavities_are_closed_and_turned_outwards(torso: Torso) -> None:
    plant = torso.plant
    for faces in (plant.chest_faces, plant.abdomen_faces):
        assert closed(faces)
        assert 2e-3 < enclosed_volume(torso.places, faces) < 15e-3


def test_the_cavities_share_the_diaphragm_reversed(torso: Torso) -> None:
    def named(faces: Ints) -> set[tuple[int, ...]]:
        return {tuple(np.roll(f, -int(np.argmin(f)))) for f in faces}

    chest, belly = torso.plant.chest_faces, torso.plant.abdomen_faces
    shared = named(chest) & named(belly[:, ::-1])
    dome = set(torso.diaphragm[:, 1:].ravel().tolist())
    assert sum(1 for f in chest if set(f.tolist()) & dome) <= len(shared)
    assert not named(chest) & named(belly)


def crossing_angles(torso: Torso) -> Floats:
    """Angle, deg, between each external element and the nearest internal one of its space."""
    m, x = torso.plant.muscles, torso.places
    angles = []
    ends = {}
    for group in ("external_intercostals", "internal_intercostals"):
        e = elements(torso, group)
        bodies = torso.plant.point_body[np.stack([m.a[e], m.b[e]])].T
        middle, run = 0.5 * (x[m.a[e]] + x[m.b[e]]), x[m.b[e]] - x[m.a[e]]
        ends[group] = (bodies, middle, run / np.linalg.norm(run, axis=1, keepdims=True))
    inner_bodies, inner_middle, inner_run = ends["internal_intercostals"]
    for bodies, middle, run in zip(*ends["external_intercostals"], strict=True):
        space = np.flatnonzero((inner_bodies == bodies).all(axis=1))
        gap = np.linalg.norm(inner_middle[space] - middle, axis=1)
        if gap.min() < 0.03:
            other = inner_run[space[np.argmin(gap)]]
            angles.append(np.degrees(np.arccos(np.clip(run @ other, -1.0, 1.0))))
    return np.array(angles)


def test_intercostal_layers_cross_at_about_a_right_angle(torso: Torso) -> None:
    angles = crossing_angles(torso)
    assert len(angles) > 200
    assert np.mean(angles) == pytest.approx(90.0, abs=10.0)


def test_external_fibres_run_forwards_and_internal_ones_back(torso: Torso) -> None:
    m, x = torso.plant.muscles, torso.places
    for group, sign in (("external_intercostals", 1.0), ("internal_intercostals", -1.0)):
        e = elements(torso, group)
        run = x[m.b[e]] - x[m.a[e]]
        # forwards along the rib: towards the front midline around the vertical axis
        centre = 0.5 * (x[m.a[e]] + x[m.b[e]])
        angle = np.arctan2(np.abs(centre[:, 1]), centre[:, 0] - torso.parameters["torso_axis"])
        front = np.column_stack([np.sin(angle), -np.cos(angle) * np.sign(centre[:, 1])])
        assert (sign * (run[:, :2] * front).sum(axis=1) > 0.0).mean() > 0.9


def test_strength_is_cross_section_times_specific_tension(torso: Torso) -> None:
    m = torso.plant.muscles
    assert (m.f_max > 0.0).all()
    assert (m.rest > 0.0).all()
    layers = {row["group"]: row for row in read_rows("muscle_layers.csv")}
    width = 1e3 * m.f_max / torso.parameters["specific_tension"]
    width /= [float(layers[MUSCLE_GROUPS[g]]["thickness_mm"]) for g in m.group]
    assert 1e-4 < width.min()
    assert width.max() < 0.08


@pytest.mark.parametrize("stature", [1.6, 1.9])
def test_it_scales_with_stature(torso: Torso, stature: float) -> None:
    other = build_torso(Subject(sex="male", stature=stature, mass=75.0))
    ratio = stature / 1.756
    np.testing.assert_allclose(other.anatomy.rib, ratio * torso.anatomy.rib, rtol=1e-9)
    for cavity in ("chest_faces", "abdomen_faces"):
        volumes = [enclosed_volume(t.places, getattr(t.plant, cavity)) for t in (other, torso)]
        # bulges of the belly wall and gaps keep their size, so the cube is only close
        assert volumes[0] / volumes[1] == pytest.approx(ratio**3, rel=0.1)


def test_fit_scale_stretches_each_axis(torso: Torso) -> None:
    wide = build_torso(MAN, fit_scale=(1.0, 1.1, 1.0))
    ratio = np.ptp(wide.anatomy.rib[..., 1]) / np.ptp(torso.anatomy.rib[..., 1])
    assert ratio == pytest.approx(1.1)
    np.testing.assert_allclose(wide.anatomy.rib[..., 2], torso.anatomy.rib[..., 2])


def test_a_woman_is_smaller_than_a_man_of_her_height(torso: Torso) -> None:
    woman = build_torso(Subject(sex="female", stature=1.756, mass=75.0))
    volumes = [enclosed_volume(t.places, t.plant.chest_faces) for t in (woman, torso)]
    # a rib cage volume 10 to 12 % smaller at the same height (Bellemare 2003)
    assert volumes[0] / volumes[1] == pytest.approx(0.89, abs=0.02)
    capacity = lung_capacity(woman.subject)
    assert all(capacity[k] < v for k, v in lung_capacity(MAN).items() if k in ("tlc", "frc"))


def test_size_is_near_the_populations(torso: Torso) -> None:
    size, anatomy = body_size(MAN), torso.anatomy
    breadth = np.ptp(anatomy.rib[..., 1]) + 2.0 * anatomy.skin
    assert breadth == pytest.approx(size["chest_breadth"], rel=0.08)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"sex": "x"}, "male or female"),
        ({"stature": 0.0}, "1.2 to 2.3"),
        ({"stature": 0.9}, "1.2 to 2.3"),
        ({"stature": 2.6}, "1.2 to 2.3"),
        ({"stature": 175.6}, "1.2 to 2.3"),
        ({"stature": float("nan")}, "1.2 to 2.3"),
        ({"mass": 0.0}, "15 to 250"),
    ],
)
def test_a_bad_subject_is_one_clear_line(change: dict[str, object], word: str) -> None:
    whom = {"sex": "male", "stature": 1.756, "mass": 75.0, **change}
    with pytest.raises(ParameterError, match=word) as error:
        Subject(**whom)  # type: ignore[arg-type]
    assert "\n" not in str(error.value)
    assert next(iter(change)) in str(error.value)
