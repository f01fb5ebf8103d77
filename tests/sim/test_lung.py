"""The lung: recoil, flow as the root of its equation, mass of the gas."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sim.model.torso import Subject, build_torso, lung_capacity
from sim.physics import lung
from sim.physics.cavities import lung_pressures
from sim.physics.plant import Plant

ATMOSPHERE, K1, K2 = 101325.0, 117700.0, 2.94e7
CMH2O = 98.0665
volumes = st.floats(1e-3, 8e-3)
pressures = st.floats(-2e4, 2e4)
steps = st.floats(1e-4, 1e-2)


@pytest.fixture(scope="module")
def plant() -> Plant:
    return build_torso(Subject(sex="male", stature=1.756, mass=75.0)).plant


@given(volumes, pressures, steps)
def test_flow_satisfies_its_equation(volume: float, pressure: float, step: float) -> None:
    gas = (ATMOSPHERE + pressure) * volume
    flow = lung.outflow(gas, volume, step, ATMOSPHERE, K1, K2, np.inf)
    alveolar = (gas - step * ATMOSPHERE * flow) / volume - ATMOSPHERE
    assert K1 * flow + K2 * flow * abs(flow) == pytest.approx(alveolar, rel=1e-7, abs=1e-6)
    assert flow * pressure >= 0.0 or abs(pressure) < 1e-9


@given(volumes, pressures, steps)
def test_a_straight_tube_is_linear(volume: float, pressure: float, step: float) -> None:
    gas = (ATMOSPHERE + pressure) * volume
    flow = lung.outflow(gas, volume, step, ATMOSPHERE, K1, 0.0, np.inf)
    expected = (gas / volume - ATMOSPHERE) / (K1 + step * ATMOSPHERE / volume)
    assert flow == pytest.approx(expected, rel=1e-12, abs=1e-15)


@given(volumes, pressures, steps)
def test_cap_holds_the_breath_out_only(volume: float, pressure: float, step: float) -> None:
    gas = (ATMOSPHERE + pressure) * volume
    free = lung.outflow(gas, volume, step, ATMOSPHERE, K1, K2, np.inf)
    capped = lung.outflow(gas, volume, step, ATMOSPHERE, K1, K2, 1e-4)
    assert capped == (min(free, 1e-4) if free > 0.0 else free)


@pytest.mark.parametrize("cap", [np.inf, 1e-5])
@given(volumes, pressures, steps)
def test_alveolar_stiffness_is_the_derivative(
    cap: float, volume: float, pressure: float, step: float
) -> None:
    """Also where the flow is limited: the gas is shut in and three times as stiff at RV."""
    gas = (ATMOSPHERE + pressure) * volume
    flow = lung.outflow(gas, volume, step, ATMOSPHERE, K1, K2, cap)
    assume(flow == cap or flow < 0.5 * cap)

    def alveolar(at: float) -> float:
        flow = lung.outflow(gas, at, step, ATMOSPHERE, K1, K2, cap)
        return (gas - step * ATMOSPHERE * flow) / at - ATMOSPHERE

    h = 1e-7 * volume
    slope = lung.alveolar_stiffness(gas, volume, flow, step, ATMOSPHERE, K1, K2, cap)
    assert slope == pytest.approx((alveolar(volume - h) - alveolar(volume + h)) / (2 * h), rel=1e-3)


@given(st.floats(1e-3, 7.5e-3))
def test_recoil_stiffness_is_the_derivative(volume: float) -> None:
    limit, scale, rate = 8e-3, 5e-3, 4.6e-4
    h = 1e-9
    slope = lung.recoil_pressure(volume + h, limit, scale, rate)
    slope -= lung.recoil_pressure(volume - h, limit, scale, rate)
    found = lung.recoil_stiffness(volume, limit, scale, rate)
    assert found == pytest.approx(slope / (2.0 * h), rel=1e-4)


def test_recoil_goes_on_without_a_jump_past_its_end() -> None:
    limit, scale, rate = 8e-3, 5e-3, 4.6e-4
    edge, h = limit - 0.02 * scale, 1e-12
    below, above = (lung.recoil_pressure(edge + s * h, limit, scale, rate) for s in (-1, 1))
    assert above == pytest.approx(below, rel=1e-6)
    assert lung.recoil_pressure(limit + 1e-3, limit, scale, rate) > below


def test_recoil_at_frc_and_at_tlc(plant: Plant) -> None:
    # 5 cmH2O at FRC and 30 at TLC (Rahn 1946; Agostoni & Hyatt 1986)
    k, capacity = plant.constants, lung_capacity(Subject(sex="male", stature=1.756, mass=75.0))
    curve = (k.lung_limit, k.lung_scale, k.lung_rate)
    at_frc = lung.recoil_pressure(capacity["frc"], *curve)
    at_tlc = lung.recoil_pressure(capacity["tlc"], *curve)
    assert at_frc / CMH2O == pytest.approx(5.0, rel=1e-3)
    assert at_tlc / CMH2O == pytest.approx(30.0, rel=2e-3)


def test_compliance_at_frc_within_the_measured_range(plant: Plant) -> None:
    k, capacity = plant.constants, lung_capacity(Subject(sex="male", stature=1.756, mass=75.0))
    slope = lung.recoil_stiffness(capacity["frc"], k.lung_limit, k.lung_scale, k.lung_rate)
    # 0.13 to 0.3 L/cmH2O (West; Galetke 2007)
    assert 0.13 <= 1e3 * CMH2O / slope <= 0.3


@given(st.floats(0.2e-3, 8e-3))
def test_expiratory_flow_falls_to_nothing_at_residual_volume(volume: float) -> None:
    residual, total, peak = 1.7e-3, 7e-3, 9e-3
    cap = lung.flow_cap(volume, residual, total, peak)
    assert 0.0 < cap <= peak
    if volume <= residual:
        assert cap == pytest.approx(1e-3 * peak)
    if volume >= residual + 0.85 * (total - residual):
        assert cap == pytest.approx(peak)


def test_gas_leaves_by_the_flow_and_by_nothing_else(plant: Plant) -> None:
    k = plant.constants
    chest, step = k.tissue_volume + 3e-3, 2e-3
    gas, out = (k.atmosphere + 2000.0) * 3e-3, np.empty(4)
    gone = 0.0
    for _ in range(500):
        left, _ = lung_pressures(plant.constants, gas, chest, 0.0, step, out)
        gone += step * out[3]
        assert left == pytest.approx(gas - step * k.atmosphere * out[3], rel=1e-14)
        gas = left
    # a lung held at one volume empties until the pressure is that of the atmosphere
    assert gas / 3e-3 == pytest.approx(k.atmosphere, rel=1e-6)
    assert gone * k.atmosphere == pytest.approx(2000.0 * 3e-3, rel=1e-3)
