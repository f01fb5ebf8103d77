"""The muscle element: closed forms, the papers' figures, no push."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.physics.muscle import (
    active_factor,
    force_length,
    force_velocity,
    hill_tension,
    passive_shape,
    spring_tension,
)

WIDTH, CURVATURE, ECCENTRIC = 0.5, 0.25, 1.4
level = st.floats(0.0, 1.0)
ratio = st.floats(0.1, 3.0)
speed = st.floats(-20.0, 20.0)
force = st.floats(0.0, 1e4)


def test_dilorenzo_fig_4_2a_force_length() -> None:
    # The parabola touches zero at half and one and a half optimal lengths, and peaks at one.
    assert force_length(0.5, WIDTH) == 0.0
    assert force_length(1.5, WIDTH) == 0.0
    assert force_length(1.0, WIDTH) == 1.0
    assert force_length(0.75, WIDTH) == force_length(1.25, WIDTH) == 0.75


def test_dilorenzo_fig_4_2b_force_velocity() -> None:
    # Hill's hyperbola with a = b = 0.25: isometric force at rest, none at the highest speed.
    assert force_velocity(0.0, CURVATURE, 0.0) == 1.0
    assert force_velocity(-1.0, CURVATURE, 0.0) == 0.0
    assert force_velocity(-0.5, CURVATURE, 0.0) == pytest.approx(0.125 / 0.75)


@given(rate=st.floats(0.0, 1.0))
def test_the_printed_law_takes_the_absolute_speed(rate: float) -> None:
    assert force_velocity(rate, CURVATURE, 0.0) == force_velocity(-rate, CURVATURE, 0.0)


@given(rate=st.floats(-1.0, 1.0))
def test_hyperbola_obeys_hills_equation(rate: float) -> None:
    # (F + a)(v + b) = (1 + a) b with force and speed over their maxima
    f = force_velocity(-abs(rate), CURVATURE, ECCENTRIC)
    assert (f + CURVATURE) * (abs(rate) + CURVATURE) == pytest.approx(1.25 * CURVATURE)


def test_slope_does_not_jump_between_shortening_and_lengthening() -> None:
    h = 1e-7
    rest = force_velocity(0.0, CURVATURE, ECCENTRIC)
    shortening = (rest - force_velocity(-h, CURVATURE, ECCENTRIC)) / h
    lengthening = (force_velocity(h, CURVATURE, ECCENTRIC) - rest) / h
    steepest = (1.0 + CURVATURE) / CURVATURE
    assert shortening == pytest.approx(steepest, rel=1e-5)
    assert lengthening == pytest.approx(steepest, rel=1e-5)


@given(slow=st.floats(-1.5, 5.0), more=st.floats(0.0, 5.0))
def test_force_never_falls_with_lengthening_speed(slow: float, more: float) -> None:
    here = force_velocity(slow, CURVATURE, ECCENTRIC)
    there = force_velocity(slow + more, CURVATURE, ECCENTRIC)
    assert here <= there + 1e-12
    assert there < ECCENTRIC


@given(ratio, speed)
def test_active_factor_is_the_product(at: float, rate: float) -> None:
    product = force_length(at, WIDTH) * force_velocity(rate, CURVATURE, ECCENTRIC)
    assert active_factor(at, rate, WIDTH, CURVATURE, ECCENTRIC) == product


@given(at=st.floats(0.2, 2.5))
def test_passive_slope_is_the_derivative(at: float) -> None:
    h = 1e-6
    numeric = (passive_shape(at + h)[0] - passive_shape(at - h)[0]) / (2.0 * h)
    assert passive_shape(at)[1] == pytest.approx(numeric, rel=1e-4)


def test_passive_curve_as_printed_up_to_a_strain_of_one_half() -> None:
    for at in (0.0, 0.2, 0.8, 1.0, 1.3, 1.5):
        printed = math.exp(10.0 * (at - 1.0)) / math.exp(5.0)
        assert passive_shape(at)[0] == pytest.approx(printed, rel=2e-14)
    assert passive_shape(1.5)[0] == pytest.approx(1.0)


@given(level, ratio, ratio, speed, speed, force, force, st.floats(0.0, 100.0))
def test_hill_tension_is_never_negative(
    activation: float, fibre: float, at: float, fibre_rate: float, rate: float,
    f_max: float, k_pe: float, b_pe: float,
) -> None:  # fmt: skip
    factor = active_factor(fibre, fibre_rate, WIDTH, CURVATURE, ECCENTRIC)
    assert hill_tension(activation * factor, at, rate, f_max, k_pe, b_pe) >= 0.0


@given(level, ratio, speed, st.floats(0.1, 1.0), force, force, st.floats(0.0, 100.0))
def test_spring_tension_is_never_negative(
    activation: float, at: float, rate: float, contraction: float,
    k_ac: float, k_pe: float, damping: float,
) -> None:  # fmt: skip
    rest = 0.1
    tension = spring_tension(activation, at * rest, rate, rest, contraction, k_ac, k_pe, damping)
    assert tension >= 0.0


def test_hill_tension_isometric_at_optimal_length() -> None:
    # The passive part is exp(-5) of k_pe there.
    tension = hill_tension(0.4, 1.0, 0.0, 200.0, 50.0, 1.0)
    assert tension == pytest.approx(0.4 * 200.0 + 50.0 * math.exp(-5.0))


def test_dilorenzo_eq_4_2_spring() -> None:
    # 0.5 x 100 N/m over (0.12 - 0.8 x 0.1) m, 40 N/m over 0.02 m, 2 N s/m at 0.1 m/s
    assert spring_tension(0.5, 0.12, 0.1, 0.1, 0.8, 100.0, 40.0, 2.0) == pytest.approx(
        0.5 * 100.0 * 0.04 + 40.0 * 0.02 + 2.0 * 0.1
    )
    assert spring_tension(0.0, 0.1, 0.0, 0.1, 0.8, 100.0, 40.0, 2.0) == 0.0
