"""The skin of a torso at rest, and of every frame of its motion."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Mapping

import numpy as np

from sim.model.bone_shapes import Shape
from sim.physics.types import Floats, Ints
from sim.skin.binding import METHODS, SMOOTH
from sim.skin.body_mesh import (
    Person,
    average_build,
    body_mesh,
    find_build,
    skin_parameters,
    usual_age,
)
from sim.skin.bound import BoundSkin
from sim.skin.frame import RestPose, underneath
from sim.skin.place import place_skin

Faces = Ints
KEPT = 4
"""Dressed torsos kept: the same one is shown, played and exported again."""
_kept: dict[str, BoundSkin] = {}


def dress(
    rest: RestPose,
    shapes: Mapping[str, Shape],
    belly: Faces,
    *,
    age: float | None = None,
    fat_layer: float | None = None,
    method: str = SMOOTH,
) -> BoundSkin:
    """A human skin over a torso at rest, bound to it; the last few are kept, not to be changed.

    Parameters
    ----------
    shapes : bones by name
    belly : (m, 3), faces of the abdomen without the diaphragm's, of `rest.abdomen`
    age : years, else the usual one (`usual_age`)
    fat_layer : m, least thickness at the navel, else that of `skin.csv`
    method : of binding
    """
    years = usual_age(rest.subject) if age is None else age
    layer = skin_parameters()["fat_layer"] if fat_layer is None else fat_layer
    asked = pickle.dumps((rest, dict(shapes), belly, years, layer, method))
    key = hashlib.sha256(asked).hexdigest()
    if key not in _kept:
        while len(_kept) >= KEPT:
            del _kept[next(iter(_kept))]
        _kept[key] = _dress(rest, shapes, belly, years, layer, method)
    return _kept[key]


def _dress(
    rest: RestPose,
    shapes: Mapping[str, Shape],
    belly: Faces,
    years: float,
    layer: float,
    method: str,
) -> BoundSkin:
    person = Person(subject=rest.subject, age=years)
    mesh, average = (body_mesh(person, b) for b in (find_build(person), average_build(person)))
    vertices = place_skin(mesh, average, rest, underneath(rest, shapes), fat_layer=layer)
    about: dict[str, str | float] = {
        "made_from": "human", "method": method, "age_years": years, "fat_layer": layer,
        "muscle": mesh.build.muscle, "weight": mesh.build.weight, "mass_kg": mesh.build.mass,
    }  # fmt: skip
    return bind(vertices, mesh.faces, rest, shapes, belly, method, about)


def bind(
    vertices: Floats,
    faces: Ints,
    rest: RestPose,
    shapes: Mapping[str, Shape],
    belly: Faces,
    method: str,
    about: dict[str, str | float],
) -> BoundSkin:
    """Any skin (n, 3), m, over the torso at rest, bound by a method of `METHODS`."""
    weights = METHODS[method](vertices, faces, rest, shapes, belly)
    return BoundSkin(
        vertices=np.asarray(vertices, dtype=float), faces=faces, weights=weights, rest=rest,
        about=about,
    )  # fmt: skip
