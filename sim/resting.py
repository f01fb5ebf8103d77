"""A subject's torso at rest in its postures, with skin and markers: where every run starts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim import engine
from sim.errors import InputError
from sim.model.binding import BoundCavity, bind_cavity
from sim.model.landmarks import (
    Attachments,
    Skin,
    Surface,
    attach,
    build_skin,
    landmark_points,
    marker_places,
    skin_places,
    vertex_normals,
)
from sim.model.torso import Subject, Torso, build_torso
from sim.physics.types import Floats
from sim.rest import GRAVITY, Machine, RestState, lie_down, solve_rest
from sim.tables import Parameters


@dataclass(slots=True)
class RestingTorso:
    """Torso with its solved rest; other postures are found when first asked for.

    Parameters
    ----------
    upright : the solved rest
    skin : how the skin follows
    cavity : how the chest cavity follows, if the parameter set binds it
    """

    upright: RestState
    skin: Skin
    cavity: BoundCavity | None = None
    _rests: dict[str, RestState] = field(default_factory=dict)

    @property
    def torso(self) -> Torso:
        """The torso with slack angles and reference volumes solved."""
        return self.upright.torso

    def rest(self, posture: str) -> RestState:
        """Equilibrium in a posture, "upright" or "supine"."""
        if posture not in self._rests:
            self._rests[posture] = lie_down(self.upright, posture)
        return self._rests[posture]

    def vertices(self, posture: str) -> Floats:
        """(n, 3), skin at rest, m."""
        machine, rest = Machine(self.torso), self.rest(posture)
        machine.set_gravity(GRAVITY[posture])
        engine.predict(machine.bones, self.torso.plant, machine.work, rest.state, 0.0)
        return skin_places(
            self.skin,
            self.torso,
            machine.work.x[self.skin.point],
            machine.data.xpos,
            machine.data.xmat.reshape(-1, 3, 3),
        )

    def surface(self, posture: str) -> Surface:
        """Skin at rest, where markers can sit."""
        vertices = self.vertices(posture)
        normals = vertex_normals(vertices, self.skin.faces)
        return Surface(vertices=vertices, faces=self.skin.outside, normals=normals)

    def landmarks(self, posture: str) -> dict[str, Floats]:
        """Usual markers at rest, (3,) m each."""
        upright = self.vertices("upright")
        named = landmark_points(self.torso, upright)
        bound = attach(upright, self.skin.outside, np.array(list(named.values())))
        return dict(zip(named, marker_places(bound, self.vertices(posture)), strict=True))

    def bind(self, points: Floats, posture: str) -> Attachments:
        """Let points (n, 3), m, near the skin at rest in `posture`, ride on it."""
        if not np.isfinite(points).all():
            raise InputError("markers: a place is not a number. Leave that marker out.")
        return attach(self.vertices(posture), self.skin.outside, points)


def rest_torso(
    subject: Subject,
    *,
    fit_scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
    parameters: Parameters | None = None,
) -> RestingTorso:
    """Build a subject's torso and solve its rest.

    Parameters
    ----------
    fit_scale : per-axis size factors (X, Y, Z) on top of the population's size
    """
    torso = build_torso(subject, fit_scale=fit_scale, parameters=parameters)
    upright = solve_rest(torso)
    return RestingTorso(
        upright=upright,
        skin=build_skin(upright.torso, upright.points),
        cavity=_cavity(upright) if upright.torso.parameters["bound_cavity"] else None,
        _rests={"upright": upright},
    )


def _cavity(rest: RestState) -> BoundCavity:
    machine = Machine(rest.torso)
    engine.predict(machine.bones, rest.torso.plant, machine.work, rest.state, 0.0)
    rotation = machine.data.xmat.reshape(-1, 3, 3)
    return bind_cavity(rest.torso, machine.data.xpos, rotation, rest.points)
