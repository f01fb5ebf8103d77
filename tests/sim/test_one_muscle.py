"""One muscle and its particle: closed forms, the order of the step, no push."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.muscle_experiments import SCHEMES, convergence
from sim.muscle_rig import CONTRACTED, LAWS, RELAXED, hanging_length, make_muscle, move, rig_numbers
from sim.physics.muscle import force_velocity
from sim.physics.one_muscle import RUNGE_KUTTA, tension

NUMBERS = rig_numbers()
WEIGHT = NUMBERS["mass"] * NUMBERS["gravity"]


def test_spring_hangs_by_hookes_law() -> None:
    spring = make_muscle("spring", NUMBERS)
    rest, k = NUMBERS["rest_length"], NUMBERS["spring_k"]
    assert hanging_length(spring, 1.0, rest, 1.5 * rest) == pytest.approx(rest + WEIGHT / k)
    assert hanging_length(spring, 0.0, 0.0, rest) == pytest.approx(WEIGHT / k)


def test_activated_hill_muscle_hangs_where_the_parabola_carries_the_weight() -> None:
    hill = make_muscle("hill", NUMBERS)
    held = hanging_length(hill, 1.0, 0.5, 1.0)
    expected = 1.0 - 0.5 * np.sqrt(1.0 - WEIGHT / NUMBERS["hill_f_max"])
    assert held == pytest.approx(expected, abs=1e-4)  # the passive curve carries 0.01 N there


def test_free_spring_follows_the_damped_oscillator() -> None:
    # From 50 mm below its rest the spring is always in tension, so its law is linear.
    spring = make_muscle("spring", NUMBERS)
    m, k, b = spring.mass, spring.strength, spring.b_pe
    rest, swing, step = spring.rest + WEIGHT / k, 0.05, 1e-4
    way = move(spring, np.ones(10_000), start=rest + swing, step=step, scheme=RUNGE_KUTTA)
    decay = b / (2.0 * m)
    turn = np.sqrt(k / m - decay**2)
    exact = swing * np.exp(-decay * way.time)
    exact *= np.cos(turn * way.time) + decay / turn * np.sin(turn * way.time)
    assert way.tension.min() > 0.0
    np.testing.assert_allclose(way.place - rest, exact, atol=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_a_muscle_at_rest_stays(law: str) -> None:
    muscle = make_muscle(law, NUMBERS)
    start = hanging_length(muscle, RELAXED[law], muscle.rest, 1.5 * muscle.rest)
    way = move(muscle, np.full(500, RELAXED[law]), start=start, step=1e-3)
    assert np.ptp(way.place) < 1e-9


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_both_steps_are_of_first_order(law: str, scheme: str) -> None:
    assert convergence(law, NUMBERS, scheme).order == pytest.approx(1.0, abs=0.1)


@settings(max_examples=40)
@given(
    law=st.sampled_from(sorted(LAWS)),
    start=st.floats(0.55, 1.45),
    step=st.sampled_from((1e-3, 4e-3, 1.6e-2)),
    loaded=st.booleans(),
)
def test_tension_is_never_negative_and_energy_is_bounded(
    law: str, start: float, step: float, loaded: bool
) -> None:
    muscle = make_muscle(law, NUMBERS, loaded=loaded)
    way = move(muscle, np.full(round(2.0 / step), CONTRACTED[law]), start=start, step=step)
    assert way.tension.min() >= 0.0
    most = NUMBERS["hill_f_max"] + NUMBERS["spring_k"] + WEIGHT  # N over 2 m at the most
    assert np.abs(way.speed).max() < np.sqrt(2.0 * most * 2.0 / muscle.mass)


@given(place=st.floats(-2.0, 2.0), speed=st.floats(-5.0, 5.0), level=st.floats(0.0, 1.0))
def test_a_muscle_is_the_same_above_and_below(place: float, speed: float, level: float) -> None:
    for law in LAWS:
        muscle = make_muscle(law, NUMBERS)
        if place != 0.0:
            there = tension(muscle, level, -place, -speed)
            assert tension(muscle, level, place, speed) == there


def test_held_muscle_does_not_move_until_it_is_released() -> None:
    muscle = make_muscle("hill", NUMBERS, loaded=False)
    way = move(muscle, np.full(800, 0.5), start=1.0, step=1e-3, held=0.5)
    assert np.ptp(way.place[:501]) == 0.0
    assert way.place[520] < way.place[500]


def test_a_stretched_muscle_is_stronger_with_the_lengthening_branch_only() -> None:
    printed, branch = (make_muscle("hill", NUMBERS, eccentric=e) for e in (0.0, 1.4))
    isometric, speed = tension(printed, 1.0, 1.0, 0.0), 0.5 * printed.v_max
    passive = tension(printed, 0.0, 1.0, speed)
    assert tension(branch, 1.0, 1.0, speed) - passive > isometric
    ours = tension(printed, 1.0, 1.0, speed) - passive
    assert ours == pytest.approx(NUMBERS["hill_f_max"] * force_velocity(0.5, 0.25, 0.0))
