"""A torso on which static experiments are made: it comes to rest under drag at every point.

Nothing here changes a parameter of the torso; an experiment holds bodies, particles, the pleural
pressure or the airway.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sim import engine
from sim.errors import UnstableSimulation
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.plant import Plant
from sim.physics.types import Floats
from sim.rest import GRAVITY, Machine, RestState, bed, copy_state
from sim.resting import RestingTorso
from sim.summary import swept_volume

STEP = 0.002
DRAG = 6.0
SPEED_LIMIT = 20.0
CLOSED = 1e12
"""Airway resistance of a closed airway, Pa s/m^3."""
SUBSTEPS = 20
"""Parts into which a change of pressure or gas is cut, so that the torso follows it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Point:
    """A static state, against the start of its experiment.

    Parameters
    ----------
    lung, chest, abdomen : volumes, m^3
    alveolar, pleural, abdominal : pressures, Pa
    rib_cage, wall : volume swept by the rib cage (apposed part included) and by the belly, m^3
    places : (n_points, 3), m
    """

    lung: float
    chest: float
    abdomen: float
    alveolar: float
    pleural: float
    abdominal: float
    rib_cage: float
    wall: float
    places: Floats


class Bench:
    """A torso on which one experiment is made; state and swept volumes go on from call to call."""

    def __init__(self, resting: RestingTorso, posture: str = "upright") -> None:
        rest: RestState = resting.rest(posture)
        self.torso, self.posture = rest.torso, posture
        self.plant: Plant = rest.torso.plant
        self.machine, self.state = Machine(rest.torso), copy_state(rest.state)
        self.locked = bed(rest.torso, posture)
        self.pleural = np.nan
        self.places = rest.points.copy()
        self.rib_cage = self.wall = 0.0
        dome = {tuple(sorted(f)) for f in self.plant.chest_faces.tolist()}
        belly = self.plant.abdomen_faces
        self.wall_faces = belly[[tuple(sorted(f)) not in dome for f in belly.tolist()]]
        both = {tuple(sorted(f)) for f in belly.tolist()}
        chest = self.plant.chest_faces
        self.rib_faces = chest[[tuple(sorted(f)) not in both for f in chest.tolist()]]

    def constants(self, **changes: Any) -> None:
        """Change constants of this experiment."""
        self.plant = self.plant._replace(constants=self.plant.constants._replace(**changes))

    def close_airway(self) -> None:
        """No flow from here on."""
        self.constants(airway_k1=CLOSED, airway_k2=0.0)

    def go(
        self, duration: float, levels: dict[str, float] | None = None, drag: float = DRAG
    ) -> Point:
        """Run on for `duration` s with constant activations and say where it stands."""
        n = round(duration / STEP)
        activation = np.zeros((n, len(MUSCLE_GROUPS)))
        for group, level in (levels or {}).items():
            activation[:, MUSCLE_GROUPS.index(group)] = level
        gravity = GRAVITY[self.posture]
        drive = engine.make_drive(
            activation, gravity=gravity, locked=self.locked, pleural=self.pleural
        )
        schedule = engine.Schedule(
            step=STEP, refresh_every=10, record_every=n, drag=drag, speed_limit=SPEED_LIMIT
        )
        record = engine.make_record(1, n_q=len(self.state.qpos), n_particles=self.torso.n_particles)
        self.machine.set_gravity(gravity)
        work = self.machine.work
        done = engine.run(self.machine.bones, self.plant, work, self.state, schedule, drive, record)
        if done < n:
            raise UnstableSimulation(f"bench: the torso diverged after {done * STEP:.3f} s.")
        engine.predict(self.machine.bones, self.plant, work, self.state, 0.0)
        return self._stand(record.scalars[0])

    def _stand(self, scalars: Floats) -> Point:
        x = self.machine.work.x.copy()
        self.rib_cage += swept_volume(self.places, x, self.rib_faces)
        self.wall += swept_volume(self.places, x, self.wall_faces)
        self.places = x
        lung, chest, abdomen, alveolar, pleural, abdominal = (float(s) for s in scalars[:6])
        return Point(
            lung=lung, chest=chest, abdomen=abdomen, alveolar=alveolar, pleural=pleural,
            abdominal=abdominal, rib_cage=self.rib_cage, wall=self.wall, places=x,
        )  # fmt: skip

    def ramp(self, duration: float, levels: dict[str, float], hold: float) -> Point:
        """Raise activations from nothing in `SUBSTEPS` stairs, then hold them."""
        for k in range(1, SUBSTEPS + 1):
            share = {g: level * k / SUBSTEPS for g, level in levels.items()}
            self.go(duration / SUBSTEPS, share)
        return self.go(hold, levels)
