"""Errors and baselines against closed forms."""

import numpy as np
import pytest

from pipeline.cost import (
    cycle_frames,
    leading_modes,
    mean_cycle,
    mean_distance,
    mode_residual,
    play,
    velocity,
    without_offset,
)
from pipeline.scoring import Breath, score

RATE = 50.0


def breathing(times, amplitude=0.01):
    """Two markers that move along X, one twice as far as the other."""
    shape = np.zeros((2, 3))
    shape[:, 0] = amplitude, 2 * amplitude
    return np.sin(2 * np.pi * times / 4)[:, None, None] * shape


def frames_of(positions, n_cycles, period=4.0):
    onset = period * np.arange(n_cycles)
    events = np.column_stack([onset, onset + 0.4 * period, onset + period])
    return cycle_frames(
        positions,
        np.arange(len(positions)) / RATE,
        events,
        np.arange(n_cycles),
        inspiration_time=0.4 * period,
        expiration_time=0.6 * period,
        rate=RATE,
    )


def rows(positions, model, n_cycles=6, **options):
    breath = Breath(time=np.arange(0, 4, 1 / RATE), positions=model, period=4.0)
    return score(
        "test",
        frames_of(positions, n_cycles),
        breath,
        np.arange(positions.shape[1]),
        window=0.2,
        min_cycles=5,
        **options,
    )


def test_error_is_the_mean_distance_and_ignores_missing_values():
    difference = np.zeros((2, 2, 3))
    difference[0, 0] = 3, 4, 0
    difference[1, 1] = np.nan
    assert mean_distance(difference) == pytest.approx(5 / 3)


def test_offset_is_removed_once_or_for_each_group():
    difference = np.repeat([1.0, 3.0], 4)[:, None, None] * np.ones((1, 2, 3))
    groups = np.repeat([0, 1], 4)
    assert np.allclose(without_offset(difference)[:4], -1)
    assert np.allclose(without_offset(difference, groups), 0)


def test_velocity_of_a_line_is_its_slope_and_no_difference_crosses_breaths():
    times = np.arange(100) / RATE
    line = times[:, None, None] * np.ones((1, 1, 3)) * 0.3
    line[50:] += 7.0
    found = velocity(line, np.repeat([0, 1], 50), RATE, 0.2)
    seen = np.isfinite(found)
    assert np.allclose(found[seen], 0.3)
    assert 80 * 3 == seen.sum()


def test_play_repeats_the_breath_and_meets_itself():
    time = np.array([0.0, 1.0, 2.0])
    positions = np.array([0.0, 1.0, 2.0])[:, None, None] * np.ones((1, 1, 3))
    found = play(time, positions, 4.0, np.array([0.5, 3.0, 4.5, -1.0]))[:, 0, 0]
    assert np.allclose(found, [0.5, 1.0, 0.5, 1.0])


def test_breath_times_stretch_inspiration_and_expiration_apart():
    frames = cycle_frames(
        np.zeros((100, 1, 3)),
        np.arange(100) / 10.0,
        np.array([[1.0, 3.0, 9.0]]),
        np.array([7]),
        inspiration_time=1.0,
        expiration_time=2.0,
        rate=10.0,
    )
    assert set(frames.cycle) == {7}
    assert frames.breath_time[0] == pytest.approx(0.0)
    assert frames.breath_time[10] == pytest.approx(0.5)
    assert frames.breath_time[20] == pytest.approx(1.0)
    assert frames.breath_time[50] == pytest.approx(2.0)


def test_one_mode_explains_motion_along_one_line_even_with_gaps():
    centred = breathing(np.arange(200) / RATE)
    # gaps half a period apart take nothing from the mean
    centred[20:30, 0] = centred[120:130, 0] = np.nan
    left = mode_residual(without_offset(centred), leading_modes(without_offset(centred), 1))
    assert np.isnan(left[20:30, 0]).all()
    assert mean_distance(left) < 1e-6


def test_modes_leave_no_more_than_not_moving_and_less_with_every_mode():
    rng = np.random.default_rng(3)
    centred = without_offset(rng.normal(size=(120, 4, 3)))
    errors = [mean_distance(mode_residual(centred, leading_modes(centred, k))) for k in (1, 2, 4)]
    assert mean_distance(centred) > errors[0] > errors[1] > errors[2]


def test_the_true_breath_scores_zero_and_stillness_its_closed_form():
    positions = breathing(np.arange(6 * 4 * RATE) / RATE) + 0.4
    truth = breathing(np.arange(0, 4, 1 / RATE))
    row = rows(positions, truth)
    # mean |sin| is 2 / pi; the markers move by 10 and 20 mm
    assert row["error_p_still_mm"] == pytest.approx(15 * 2 / np.pi, rel=1e-3)
    assert row["error_p_mm"] < 1e-9
    assert row["error_v_mm_s"] < 1e-9
    assert row["explained"] == pytest.approx(1)
    assert row["error_p_absolute_mm"] == pytest.approx(400 * np.sqrt(3), rel=1e-6)
    assert row["reference_1_mm"] < 1e-9
    still = rows(positions, np.zeros_like(truth))
    assert still["explained"] == pytest.approx(0)
    assert still["verdict"] == "no better than not moving"


def test_error_does_not_depend_on_where_the_markers_are():
    positions = breathing(np.arange(6 * 4 * RATE) / RATE)
    model = breathing(np.arange(0, 4, 1 / RATE), amplitude=0.007)
    here, there = rows(positions, model), rows(positions + np.array([1.0, -2.0, 3.0]), model)
    assert here["error_p_mm"] == pytest.approx(there["error_p_mm"])


def test_spread_is_what_the_other_breaths_leave():
    size = np.repeat([1.0, 2.0], 4 * int(RATE))
    positions = size[:, None, None] * breathing(np.arange(8 * RATE) / RATE)
    row = rows(positions, breathing(np.arange(0, 4, 1 / RATE)), n_cycles=2)
    # each breath is predicted by the other: off by 10 and 20 mm at the peak, with signs apart
    assert row["spread_mm"] == pytest.approx(15 * 2 / np.pi, rel=1e-2)
    assert row["verdict"] == "n = 2: no verdict under 5 breaths"


def test_an_offset_for_each_breath_takes_out_drift():
    times = np.arange(6 * 4 * RATE) / RATE
    steps = 0.01 * np.floor(times / 4 + 1e-9)
    positions = breathing(times) + steps[:, None, None]
    truth = breathing(np.arange(0, 4, 1 / RATE))
    assert rows(positions, truth, by_cycle=True)["error_p_mm"] < 1e-9
    assert rows(positions, truth)["error_p_mm"] > 10


def test_mean_cycle_undoes_the_warp():
    positions = breathing(np.arange(3 * 4 * RATE) / RATE)
    grid = np.linspace(0, 3.9, 40)
    for warped in mean_cycle(frames_of(positions, 3), grid).values():
        assert np.allclose(warped, breathing(grid), atol=1e-4)
