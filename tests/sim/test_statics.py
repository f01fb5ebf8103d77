"""Static experiments: what has to hold whatever the torso's numbers are."""

from __future__ import annotations

import numpy as np
import pytest

from sim.bench import Bench, Point
from sim.model.torso import lung_capacity
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.statics import (
    LITRE,
    WEIGHT,
    airway_pressure,
    as_arrays,
    at_volume,
    closed_effort,
    compliance,
    diaphragm_rise,
    inspired_effort,
    relaxation,
)
from sim.units import PASCAL_PER_CMH2O


def test_swept_volumes_add_up_to_the_change_of_the_chest(resting: RestingTorso) -> None:
    rest = resting.torso.parameters["end_expiratory_pleural"]
    low, start, high = relaxation(resting, np.array([rest - 250.0, rest + 250.0]), "upright")
    assert low.lung < start.lung < high.lung
    for point in (low, high):
        swept = point.rib_cage + point.wall - start.rib_cage - start.wall
        assert swept == pytest.approx(point.chest - start.chest, abs=0.01 * LITRE)


def test_rest_is_where_the_bench_starts(resting: RestingTorso) -> None:
    point = Bench(resting).go(0.5)
    assert point.lung == pytest.approx(lung_capacity(resting.torso.subject)["frc"], rel=1e-3)
    assert point.pleural / PASCAL_PER_CMH2O == pytest.approx(-5.0, abs=0.05)
    assert abs(point.rib_cage) + abs(point.wall) < 0.005 * LITRE


def test_closed_airway_keeps_the_gas(resting: RestingTorso) -> None:
    volume = lung_capacity(resting.torso.subject)["frc"] + 0.5 * LITRE
    bench = at_volume(resting, volume)
    gas = float(bench.state.gas[0])
    point = bench.go(0.5, {"diaphragm": 0.2})
    # a closed airway is a resistance of 1e12 Pa s/m^3: a few kPa let out some 1e-8 of the gas
    assert float(bench.state.gas[0]) == pytest.approx(gas, rel=1e-6)
    atmosphere = bench.plant.constants.atmosphere
    assert point.lung * (point.alveolar + atmosphere) == pytest.approx(gas, rel=1e-3)


def test_braced_bones_stand_still_in_an_effort(resting: RestingTorso) -> None:
    frc = lung_capacity(resting.torso.subject)["frc"]
    before, during = closed_effort(resting, frc, {"diaphragm": 0.3}, braced=True)
    rib = resting.torso.rows[0][4]
    assert np.abs(during.places[rib] - before.places[rib]).max() < 1e-4
    assert during.abdominal - during.pleural > before.abdominal - before.pleural


def fibre_lengths(resting: RestingTorso, point: Point) -> Floats:
    way = np.diff(point.places[resting.torso.diaphragm], axis=1)
    return np.asarray(np.linalg.norm(way, axis=2).sum(axis=1))


def test_no_fibre_gives_way_in_a_maximal_effort_and_its_pressure_falls_with_volume(
    resting: RestingTorso,
) -> None:
    """Wanke 1990: linear fall; without hoops the weakest fibres stretched to twice their length."""
    capacity = lung_capacity(resting.torso.subject)
    rises = []
    for volume in (capacity["rv"], capacity["frc"], 0.95 * capacity["tlc"]):
        pair = closed_effort(resting, volume, {"diaphragm": 1.0}, braced=True)
        before, during = (fibre_lengths(resting, point) for point in pair)
        assert (during / before).max() < 1.05
        rises.append(diaphragm_rise(pair))
    assert rises[0] > rises[1] > rises[2] > 0.0


def test_own_inspiration_leaves_the_diaphragm_shorter_than_filling(resting: RestingTorso) -> None:
    relaxed, active = inspired_effort(resting, {"diaphragm": 0.15, "external_intercostals": 0.3})
    filled, passive = closed_effort(resting, active.lung, {"diaphragm": 1.0}, braced=True)
    assert active.lung > relaxed.lung + 0.5 * LITRE
    assert passive.lung > active.lung

    def fibres(point: Point) -> float:
        return float(fibre_lengths(resting, point).mean())

    assert fibres(active) < fibres(passive) < fibres(filled)
    assert diaphragm_rise((relaxed, active)) < diaphragm_rise((filled, passive))


def test_compliance_is_the_slope_from_rest_up_to_the_weight(resting: RestingTorso) -> None:
    point = Bench(resting).go(0.1)
    assert as_arrays([point], point)["rib_cage"] == pytest.approx([0.0])
    pleural = np.array([-20.0, -7.0, -5.0, -3.0, 0.0, 10.0])
    airway = np.array([-30.0, -4.0, 0.0, 4.0, 9.0, 25.0])
    volume = np.where((airway >= 0.0) & (airway <= WEIGHT), 0.1 * pleural, 99.0)
    assert compliance(airway, pleural, volume) == pytest.approx(0.1)


def test_at_rest_nothing_is_at_the_airway(resting: RestingTorso) -> None:
    point = Bench(resting).go(0.5)
    airway = airway_pressure(resting, as_arrays([point], point))
    assert airway == pytest.approx([0.0], abs=0.1)
