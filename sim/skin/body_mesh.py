"""The shape of a person's skin by sex, age, stature and mass, before it meets any bone.

`sim/data/skin.npz` holds MakeHuman's base mesh above the thighs with its morph targets;
`scripts/make_skin.py` derives it, `skin.json` says from what.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from sim.errors import ParameterError
from sim.model.anatomy import Subject
from sim.physics.types import Floats, Ints
from sim.tables import DATA, Parameters, column, read_rows

SEXES = ("male", "female")
MIRROR = np.array([1.0, -1.0, 1.0])
STEPS = 301
"""Builds that are tried along the path of `skin_build.csv`."""
AGES = (1.0, 90.0)
GROWN = 1.45
"""m; whoever is taller is taken as grown up unless an age is given."""


@cache
def skin_arrays() -> dict[str, np.ndarray]:
    """Arrays of `skin.npz`."""
    with np.load(DATA / "skin.npz") as archive:
        return {key: archive[key] for key in archive.files}


@cache
def skin_parameters() -> Parameters:
    """Numbers of `skin.csv`."""
    rows = read_rows("skin.csv")
    return Parameters(numbers={row["name"]: float(row["value"]) for row in rows}, name="skin")


@dataclass(frozen=True, kw_only=True, slots=True)
class Person:
    """Whom a skin is made for.

    Parameters
    ----------
    subject : sex, stature and mass
    age : years
    """

    subject: Subject
    age: float

    def __post_init__(self) -> None:
        if not AGES[0] <= self.age <= AGES[1]:
            raise ParameterError(f"age is {self.age:g} years. Give {AGES[0]:g} to {AGES[1]:g}.")


@dataclass(frozen=True, kw_only=True, slots=True)
class Build:
    """What a body looks like and how well its mass is met.

    Parameters
    ----------
    muscle, weight : sliders in [0, 1]
    layer : m, laid on everywhere because the sliders end before the mass does
    mass : kg, of the whole body's volume
    """

    muscle: float
    weight: float
    layer: float
    mass: float


@dataclass(frozen=True, kw_only=True, slots=True)
class BodyMesh:
    """A skin with arms held out, as the base mesh has them.

    Parameters
    ----------
    vertices : (n, 3), m; faces : (m, 3), outward
    arm : (n,), share of the arms below the shoulder
    landmarks : (3,) m each, of the left side and the midline
    build : how the mass was met
    grown : whether the measured breadths of adults hold
    """

    vertices: Floats
    faces: Ints
    arm: Floats
    landmarks: dict[str, Floats]
    build: Build
    grown: bool


def usual_age(subject: Subject) -> float:
    """Age (years) when none is given: of a child's median stature (`growth.csv`), else 25."""
    if subject.stature >= GROWN:
        return skin_parameters()["young_age"]
    rows = [row for row in read_rows("growth.csv") if row["sex"] == subject.sex]
    return float(np.interp(subject.stature, column(rows, "stature_m"), column(rows, "age_years")))


def age_slider(age: float) -> float:
    """Place of an age (years) on the slider from baby (0) to old (1)."""
    p = skin_parameters()
    years = [p[f"{stage}_age"] for stage in ("baby", "child", "young", "old")]
    return float(np.interp(age, years, skin_arrays()["shape/ages"]))


def find_build(person: Person) -> Build:
    """Muscle and weight together, on the whole body's volume, so that the mass is met.

    A mass beyond the path's end is met by a layer on the whole area; one before its beginning
    is not met, and `Build.mass` tells by how much.
    """
    arrays, subject = skin_arrays(), person.subject
    sex, age = SEXES.index(subject.sex), age_slider(person.age)
    rows = read_rows("skin_build.csv")
    along = np.linspace(0.0, len(rows) - 1.0, STEPS)
    path = {key: np.interp(along, column(rows, "step"), column(rows, key))
            for key in ("muscle", "weight")}  # fmt: skip
    nodes = (arrays["whole/ages"], arrays["whole/build"], arrays["whole/build"])
    at = np.stack([np.full(STEPS, age), path["muscle"], path["weight"]], axis=1)
    stature, volume, area = (
        RegularGridInterpolator(nodes, arrays[f"whole/{key}"][sex])(at)
        for key in ("stature", "volume", "area")
    )
    grown = subject.stature / stature
    mass = skin_parameters()["body_density"] * volume * grown**3
    mass = np.maximum.accumulate(mass)
    step = float(np.interp(subject.mass, mass, along))
    met = float(np.interp(step, along, mass))
    missing = max(subject.mass - met, 0.0) / skin_parameters()["body_density"]
    return Build(
        muscle=float(np.interp(step, along, path["muscle"])),
        weight=float(np.interp(step, along, path["weight"])),
        layer=missing / float((area * grown**2)[-1]),
        mass=max(met, subject.mass) if missing else met,
    )


def _levels(sex: int, age: float, build: Build) -> Floats:
    """Levels (k,) of the components between the corners."""
    arrays = skin_arrays()
    nodes = (arrays["shape/ages"], np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    between = RegularGridInterpolator(nodes, arrays["shape/levels"][sex].astype(float))
    return np.asarray(between([[age, build.muscle, build.weight]])[0])


def _stature(sex: int, age: float, build: Build) -> float:
    """Stature of the mesh, m."""
    arrays = skin_arrays()
    nodes = (arrays["whole/ages"], arrays["whole/build"], arrays["whole/build"])
    tall = RegularGridInterpolator(nodes, arrays["whole/stature"][sex])
    return float(tall([[age, build.muscle, build.weight]])[0])


def average_build(person: Person) -> Build:
    """What a person of this sex, age and stature looks like on average."""
    p = skin_parameters()
    arrays, sex = skin_arrays(), SEXES.index(person.subject.sex)
    build = Build(muscle=0.5, weight=0.5, layer=0.0, mass=np.nan)
    age = age_slider(person.age)
    nodes = (arrays["whole/ages"], arrays["whole/build"], arrays["whole/build"])
    volumes = RegularGridInterpolator(nodes, arrays["whole/volume"][sex])
    volume = float(volumes([[age, build.muscle, build.weight]])[0])
    grown = person.subject.stature / _stature(sex, age, build)
    return replace(build, mass=p["body_density"] * volume * grown**3)


def body_mesh(person: Person, build: Build) -> BodyMesh:
    """The skin of a person of a build, as tall as given; `Build.layer` is not laid on yet."""
    arrays = skin_arrays()
    sex, age = SEXES.index(person.subject.sex), age_slider(person.age)
    levels = _levels(sex, age, build) * arrays["shape/scale"]
    half = arrays["shape/mean"] + np.tensordot(levels, arrays["shape/components"], axes=1)
    half = half * person.subject.stature / _stature(sex, age, build)
    mirror = arrays["mirror"].astype(np.int64)
    right = mirror < 0
    vertices = half[np.where(right, -1 - mirror, mirror)]
    vertices[right] *= MIRROR
    names = [str(name) for name in arrays["landmarks/name"]]
    return BodyMesh(
        vertices=vertices,
        faces=arrays["faces"].astype(np.int64),
        arm=arrays["arm"].astype(float),
        landmarks=dict(zip(names, half[-len(names) :], strict=True)),
        build=build,
        grown=person.subject.stature >= GROWN,
    )
