"""What the torso is told: bursts, lines, pieces, and the control file that comes of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.score import FLEXION, LARYNX, Score, burst
from sim.control.curves import add_up
from sim.control.reader import parse_controls
from sim.control.writer import format_controls
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

TIME = np.arange(0.0, 3.0, 0.002)


@given(st.floats(0.0, 1.0), st.floats(0.05, 1.0), st.floats(0.01, 1.0))
def test_a_burst_is_one_period_from_nothing_to_its_height(
    start: float, period: float, height: float
) -> None:
    value = add_up((burst(start, period, height),), TIME)
    assert value.min() >= -1e-12 and value.max() <= height + 1e-12
    assert not value[(TIME < start) | (TIME >= start + period)].any()
    top = add_up((burst(start, period, height),), np.array([start + 0.5 * period]))
    assert top[0] == pytest.approx(height)


def a_score() -> Score:
    score = Score().line("abdomen", (0.0, 0.0), (0.5, 0.1), (1.0, 0.2), (2.0, 0.0))
    score = score.add("abdomen", burst(0.4, 0.2, 0.3), burst(1.2, 0.3, 0.2))
    score = score.line(LARYNX, (0.0, 0.0), (0.4, 20.0), (0.5, 40.0), (2.0, 0.0))
    return score.line(FLEXION, (0.0, 0.0), (1.0, 8.0)).shut(1.5, 1.7)


@given(st.integers(0, 1000), st.integers(1, 400))
def test_a_piece_is_told_what_the_whole_is(first: int, count: int) -> None:
    start, end = first * 0.002, (first + count) * 0.002
    whole = a_score().controls(step=0.002).drive(3.0)
    piece = a_score().between(start, end).controls(step=0.002).drive(end - start, start=start)
    part = slice(first, first + count)
    assert np.array_equal(piece.activation, whole.activation[part])
    assert np.array_equal(piece.larynx, whole.larynx[part])
    assert np.allclose(piece.bend, whole.bend[part], atol=1e-15)


def test_a_later_point_replaces_what_it_overtakes() -> None:
    score = Score().line("abdomen", (0.0, 0.0), (1.0, 0.5)).line("abdomen", (0.6, 0.2))
    assert score.lines["abdomen"] == ((0.0, 0.0), (0.6, 0.2))
    assert score.level("abdomen") == 0.2
    assert score.level("diaphragm", 0.7) == 0.7


def test_the_control_file_is_read_back_the_same() -> None:
    controls = a_score().controls(step=0.002, name="one", duration=3.0)
    again = parse_controls(format_controls(controls).encode(), "one.xml")
    assert again == controls
    larynx = again.drive(3.0).larynx
    assert larynx[250] == pytest.approx(40.0 * PASCAL_PER_CMH2O / CUBIC_METRE_PER_LITRE)
    assert again.closed_time(3.0) == pytest.approx(0.2)


def test_bursts_of_no_height_are_left_out() -> None:
    assert Score().add("abdomen", burst(0.0, 0.2, 0.0)).bursts["abdomen"] == ()
