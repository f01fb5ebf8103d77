"""The human skin: mass, size, and that bones and belly stay below it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.behaviour import run_controls
from sim.control.library import find_controls
from sim.errors import ParameterError
from sim.model.anatomy import Subject
from sim.motion import Motion, belly_faces, dressed, rest_motion, skin_surface
from sim.resting import RestingTorso
from sim.skin.body_mesh import (
    Person,
    age_slider,
    average_build,
    body_mesh,
    find_build,
    skin_arrays,
    usual_age,
)
from sim.skin.clearance import depths, edges
from sim.skin.dress import dress
from sim.skin.frame import underneath
from sim.skin.place import layer_of
from sim.tables import DATA

PEOPLE = [
    ("male", 1.756, 75.0, 25.0),
    ("female", 1.63, 62.0, 25.0),
    ("male", 1.85, 140.0, 40.0),
    ("female", 1.60, 110.0, 60.0),
    ("male", 1.20, 23.0, 7.0),
    ("female", 1.20, 22.0, 7.0),
    ("female", 1.75, 55.0, 30.0),
]


def _person(sex: str, stature: float, mass: float, age: float) -> Person:
    return Person(subject=Subject(sex=sex, stature=stature, mass=mass), age=age)


@pytest.mark.parametrize(("sex", "stature", "mass", "age"), PEOPLE)
def test_muscle_and_weight_meet_the_mass(sex: str, stature: float, mass: float, age: float) -> None:
    build = find_build(_person(sex, stature, mass, age))
    assert build.mass == pytest.approx(mass, rel=1e-6)
    assert 0 <= build.muscle <= 1 and 0 <= build.weight <= 1
    assert 0 <= build.layer < 0.03


def test_a_mass_below_the_leanest_is_told() -> None:
    build = find_build(_person("male", 2.2, 45.0, 30.0))
    assert build.mass > 45.0
    assert (build.muscle, build.weight, build.layer) == (0.0, 0.0, 0.0)


def test_more_mass_is_more_skin_everywhere_at_the_belly() -> None:
    girths = []
    for mass in (60.0, 75.0, 100.0, 140.0):
        person = _person("male", 1.756, mass, 30.0)
        mesh = body_mesh(person, find_build(person))
        near = np.abs(mesh.vertices[:, 2] - mesh.landmarks["navel"][2]) < 0.01
        girths.append(float(np.ptp(mesh.vertices[near & (mesh.arm < 0.1), 0])))
    assert girths == sorted(girths)


@pytest.mark.parametrize(("sex", "stature", "mass", "age"), PEOPLE)
def test_the_mesh_is_closed_and_a_mirror_image(
    sex: str, stature: float, mass: float, age: float
) -> None:
    person = _person(sex, stature, mass, age)
    mesh = body_mesh(person, find_build(person))
    left, right = (mesh.vertices[sign * mesh.vertices[:, 1] > 1e-6] for sign in (1, -1))
    assert len(left) == len(right)
    assert np.isfinite(mesh.vertices).all()
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    volume = np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0
    # above the thighs and without forearms lie some two thirds of a body
    assert 0.5 < 1010 * volume / find_build(person).mass < 0.8


def test_age_is_that_of_makehuman() -> None:
    assert [age_slider(age) for age in (1.0, 10.0, 25.0, 90.0)] == [0.0, 0.1875, 0.5, 1.0]
    assert usual_age(Subject(sex="male", stature=1.8, mass=80.0)) == 25.0
    assert 6.0 < usual_age(Subject(sex="female", stature=1.2, mass=22.0)) < 8.0
    with pytest.raises(ParameterError, match="age is 120 years"):
        _person("male", 1.8, 80.0, 120.0)


def test_an_average_child_is_light() -> None:
    assert 20 < average_build(_person("male", 1.2, 23.0, 7.0)).mass < 28


def test_the_provenance_names_every_array() -> None:
    about = json.loads((DATA / "skin.json").read_text())
    assert about["licence"] == "CC0-1.0"
    assert {k: list(v.shape) for k, v in skin_arrays().items()} == about["arrays"]
    assert (DATA / "skin.npz").stat().st_size < 1_000_000


def test_a_fat_layer_is_thicker_where_fat_is() -> None:
    assert layer_of("belly", 0.05) == pytest.approx(0.05)
    assert layer_of("rib", 0.05) - layer_of("rib", 0.02) == pytest.approx(0.35 * 0.03)
    assert layer_of("skull", 0.05) == layer_of("skull", 0.02)
    assert layer_of("belly", 0.0) == pytest.approx(0.003)


@pytest.fixture(scope="module")
def still(resting: RestingTorso) -> Motion:
    return dressed(rest_motion(resting, "upright"))


def _least(motion: Motion, frame: int) -> dict[str, float]:
    """Least depth of bones and belly below the skin in a frame, m."""
    skin = skin_surface(motion.frames(frame, frame + 1))
    assert motion.rest is not None
    out: dict[str, float] = {}
    for name, shape in motion.shapes.items():
        if name in ("skull", "jaw"):
            continue
        b = motion.bodies.index(shape.body)
        turn = Rotation.from_quat(motion.quaternion[frame, b], scalar_first=True)
        at = turn.apply(shape.vertices) + motion.position[frame, b]
        depth = float(depths(at, skin.vertices[0], skin.faces).depth.min())
        kind = name.split("_")[0]
        out[kind] = min(out.get(kind, np.inf), depth)
    wall = motion.soft["abdomen"].vertices[frame][motion.rest.wall]
    out["wall"] = float(depths(wall, skin.vertices[0], skin.faces).depth.min())
    return out


def test_at_rest_every_bone_has_its_layer(still: Motion) -> None:
    assert still.rest is not None and still.skin is not None
    under = underneath(still.rest, still.shapes)
    found = depths(under.points, still.skin.vertices, still.skin.faces).depth
    least = np.array([layer_of(part, 0.02) for part in under.part])
    assert (found - least).min() > -1e-3


def test_markers_lie_on_the_skin_of_the_reference_man(still: Motion) -> None:
    assert still.skin is not None
    on = [
        still.marker_names.index(name) for name in ("CLAV", "STRN", "NAVEL", "C7", "UABD", "LABD")
    ]
    found = depths(still.markers[0, on], still.skin.vertices, still.skin.faces).depth
    assert np.abs(found).max() < 0.01


def test_a_thicker_layer_moves_the_belly_out(still: Motion) -> None:
    assert still.rest is not None and still.skin is not None
    fat = dress(still.rest, still.shapes, belly_faces(still), fat_layer=0.06)
    wall = still.rest.abdomen[still.rest.wall]
    assert depths(wall, fat.vertices, fat.faces).depth.min() > 0.059
    assert fat.vertices[:, 0].max() > still.skin.vertices[:, 0].max() + 0.01


@pytest.mark.slow
@pytest.mark.parametrize("style", ["deep", "laugh", "vital_capacity"])
def test_nothing_pokes_through_and_nothing_tears(resting: RestingTorso, style: str) -> None:
    controls = find_controls(style)
    duration = controls.run_duration
    assert duration is not None
    done = run_controls(resting, controls, duration=duration, posture="upright")
    motion = dressed(done.motion)
    assert motion.skin is not None
    lung = motion.volumes["lung"]
    frames = [int(lung.argmin()), int(lung.argmax()), *range(0, len(lung), max(1, len(lung) // 12))]
    for frame in frames:
        least = _least(motion, frame)
        assert min(least.values()) > 0.004, (frame, least)
        assert least["wall"] > 0.01
    skin = motion.skin
    ends = edges(skin.faces)
    long = np.linalg.norm(skin.vertices[ends[:, 0]] - skin.vertices[ends[:, 1]], axis=1)
    for frame in frames:
        places = skin_surface(motion.frames(frame, frame + 1)).vertices[0]
        now = np.linalg.norm(places[ends[:, 0]] - places[ends[:, 1]], axis=1)
        assert 0.4 < (now / long).min() and (now / long).max() < 1.7
        a, b, c = (places[skin.faces[:, k]] for k in range(3))
        p, q, r = (skin.vertices[skin.faces[:, k]] for k in range(3))
        assert ((np.cross(b - a, c - a) * np.cross(q - p, r - p)).sum(axis=1) > 0).all()


def test_a_torso_is_dressed_once(resting: RestingTorso) -> None:
    still = rest_motion(resting, "upright")
    first, again = dressed(still).skin, dressed(rest_motion(resting, "upright")).skin
    assert first is again
    older = dressed(still, age=70.0).skin
    assert older is not None and older is not first and older.about["age_years"] == 70.0
