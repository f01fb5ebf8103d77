"""Static experiments: relaxation, inflation of the belly, efforts with the airway closed or open.

Each starts from the solved rest. The calibration ladder and the validation table both use them.
"""

from __future__ import annotations

import numpy as np

from sim.bench import SUBSTEPS, Bench, Point
from sim.physics import lung
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats
from sim.rest import HOLD
from sim.resting import RestingTorso
from sim.units import PASCAL_PER_CMH2O

LITRE = 1e-3
WEIGHT = 10.0
"""cmH2O, pressure at the airway up to which a weighted spirometer inflates."""
NEAR_REST = 0.1
"""cmH2O, by which the airway pressure of the resting point may miss nothing."""
RISE, HELD = 1.0, 2.0
"""s, over which an effort rises and for which it is held."""


def belly_inflation(
    resting: RestingTorso, volumes: Floats, *, wall_alone: bool
) -> tuple[list[Point], Point]:
    """Supine and relaxed, the contents of the belly grow.

    Parameters
    ----------
    volumes : (n,), contents added, m^3, rising
    wall_alone : hold bones and diaphragm

    Returns
    -------
    a point for each volume; the start
    """
    bench = Bench(resting, "supine")
    if wall_alone:
        bench.locked[:] = HOLD
        dome = bench.torso.diaphragm.ravel()
        dome = dome[dome >= bench.torso.n_bound] - bench.torso.n_bound
        inertia = bench.plant.particle_inertia.copy()
        inertia[dome] = HOLD
        bench.plant = bench.plant._replace(particle_inertia=inertia)
    start = bench.go(1.0)
    base, points, last = bench.plant.constants.abdomen_volume, [], 0.0
    for volume in volumes:
        for k in range(1, SUBSTEPS + 1):
            bench.constants(abdomen_volume=base + last + (volume - last) * k / SUBSTEPS)
            bench.go(0.05)
        last = float(volume)
        points.append(bench.go(2.0))
    return points, start


def relaxation(resting: RestingTorso, pressures: Floats, posture: str) -> list[Point]:
    """The relaxed chest wall at pleural pressures (n,), Pa, from rest outwards.

    The first point of each way out is that of rest itself, at its own pleural pressure.
    """
    found: dict[float, Point] = {}
    for sign in (-1.0, 1.0):
        bench = Bench(resting, posture)
        last = rest = bench.go(1.0).pleural
        bench.pleural = rest
        found[rest] = bench.go(3.0)
        for p in sorted((q for q in pressures if sign * (q - rest) > 0.0), key=lambda q: sign * q):
            for k in range(1, SUBSTEPS + 1):
                bench.pleural = last + (p - last) * k / SUBSTEPS
                bench.go(0.1)
            bench.pleural = last = float(p)
            found[last] = bench.go(5.0)
    return [found[p] for p in sorted(found)]


def at_volume(resting: RestingTorso, volume: float, posture: str = "upright") -> Bench:
    """A relaxed torso whose lung is filled or emptied to about `volume`, m^3, airway closed."""
    bench = Bench(resting, posture)
    bench.close_airway()
    here = resting.torso.plant.constants
    now = enclosed_volume(bench.places, bench.plant.chest_faces) - here.tissue_volume
    start, end = bench.state.gas[0], bench.state.gas[0] + here.atmosphere * (volume - now)
    for k in range(1, 2 * SUBSTEPS + 1):
        bench.state.gas[0] = start + (end - start) * k / (2 * SUBSTEPS)
        bench.go(0.05)
    bench.go(3.0)
    return bench


def closed_effort(
    resting: RestingTorso, volume: float, levels: dict[str, float], *, braced: bool = False
) -> tuple[Point, Point]:
    """Muscles contract against a closed airway at a lung volume, m^3: before and during.

    Parameters
    ----------
    levels : muscle group to activation
    braced : hold the bones but for the central tendon, as other muscles do in a maximal effort
    """
    bench = at_volume(resting, volume)
    if braced:
        _brace(bench)
    before = bench.go(0.5)
    return before, bench.ramp(RISE, levels, hold=HELD)


def _brace(bench: Bench) -> None:
    """Hold all bones but the central tendon."""
    bench.locked[:] = HOLD
    start = int(bench.torso.skeleton.model.joint("central_tendon").dofadr[0])
    bench.locked[start : start + 6] = 0.0


def inspired_effort(resting: RestingTorso, levels: dict[str, float]) -> tuple[Point, Point]:
    """Inspire, close the airway, brace, and contract the diaphragm fully: relaxed, during.

    The measured maxima at high volume are made like this: the volume is reached by the muscles'
    own work, so that the diaphragm is shorter than in a torso filled from outside.
    """
    bench = Bench(resting)
    before = bench.go(0.5)
    bench.ramp(RISE, levels, hold=2.0 * HELD)
    bench.close_airway()
    _brace(bench)
    return before, bench.go(HELD, {**levels, "diaphragm": 1.0})


def open_effort(resting: RestingTorso, levels: dict[str, float]) -> tuple[Point, Point]:
    """The same muscles with the airway open: before and during."""
    bench = Bench(resting)
    before = bench.go(0.5)
    return before, bench.ramp(RISE, levels, hold=2.0 * HELD)


def diaphragm_rise(pair: tuple[Point, Point]) -> float:
    """By how much transdiaphragmatic pressure rises in an effort, cmH2O."""
    before, during = pair
    rise = during.abdominal - during.pleural - before.abdominal + before.pleural
    return rise / PASCAL_PER_CMH2O


def as_arrays(points: list[Point], start: Point) -> dict[str, Floats]:
    """Volumes, L, and pressures, cmH2O, of points as arrays, swept volumes against `start`."""
    return {
        "lung": np.array([p.lung for p in points]) / LITRE,
        "rib_cage": np.array([p.rib_cage - start.rib_cage for p in points]) / LITRE,
        "wall": np.array([p.wall - start.wall for p in points]) / LITRE,
        "pleural": np.array([p.pleural for p in points]) / PASCAL_PER_CMH2O,
        "abdominal": np.array([p.abdominal - start.abdominal for p in points]) / PASCAL_PER_CMH2O,
    }


def airway_pressure(resting: RestingTorso, curve: dict[str, Floats]) -> Floats:
    """cmH2O, of a relaxed torso: that of the chest wall and the lung's recoil, of `as_arrays`."""
    k = resting.torso.plant.constants
    recoil = [
        lung.recoil_pressure(v * LITRE, k.lung_limit, k.lung_scale, k.lung_rate)
        for v in curve["lung"]
    ]
    return np.asarray(curve["pleural"] + np.array(recoil) / PASCAL_PER_CMH2O)


def compliance(airway: Floats, pleural: Floats, volume: Floats) -> float:
    """L/cmH2O of a part of the chest wall: slope of its volume against pleural pressure.

    As a weighted spirometer finds it (Estenne 1985): from rest up to `WEIGHT` at the airway, all
    muscles relaxed. Below rest the chest wall is stiffer and is not part of it.

    Parameters
    ----------
    airway, pleural : (n,), cmH2O
    volume : (n,), L
    """
    loaded = (airway >= -NEAR_REST) & (airway <= WEIGHT)
    return float(np.polyfit(pleural[loaded], volume[loaded], 1)[0])
