"""Planted levels: simulate, add noise, fit, recover."""

import dataclasses

import numpy as np
import pytest

from pipeline import records
from pipeline.breaths import signature_breath, used_cycles, without_cycles
from pipeline.fit import FitResult, fit_breath
from pipeline.optimise import Stop
from sim.errors import InputError

TRUTH = np.array([0.30, 0.15, 0.05, 0.0])


@pytest.fixture
def small(fit_settings):
    """Few runs and an instrument without a radius: the plant's markers sit on its skin."""
    return dataclasses.replace(
        fit_settings,
        n_initial=24,
        n_evaluations=24,
        heldout_every=0,
        n_cycle_checks=1,
        marker_radius_m=0.0,
        frame_rate_hz=10.0,
    )


def test_planted_levels_come_back_through_half_a_millimetre_of_noise(plant, small):
    recording, signature, truth = plant.record(TRUTH, jitter=0.05, level_jitter=0.03)
    settings = dataclasses.replace(small, heldout_every=3, heldout_evaluations=12)
    found = fit_breath(recording, signature, plant.Model(), settings, 7)
    assert np.abs(found.levels - truth.mean(axis=0)).max() < 0.02
    rows = {row["scope"]: row for row in found.errors}
    assert rows["signature_all"]["explained"] > 0.85
    # noise of 0.5 mm an axis is all that is left of the single breaths
    assert rows["heldout_all"]["error_p_mm"] < 1.0
    assert rows["heldout_all"]["error_p_mm"] < 0.5 * rows["heldout_all"]["error_p_still_mm"]
    assert rows["heldout_all"]["n_cycles"] == 3
    assert {"cycles_sagittal", "cycles_steady_all", "heldout_steady_sagittal"} <= set(rows)
    # each breath had levels of its own
    own = found.cycle_levels - truth[found.cycle_id]
    assert np.median(np.abs(own)) < 0.02
    assert np.corrcoef(found.cycle_levels[:, 0], truth[found.cycle_id, 0])[0, 1] > 0.8
    # and is scored with them: no worse than one breath for all
    for scope in ("steady_all", "steady_sagittal"):
        own_error = rows[f"own_{scope}"]["error_p_mm"]
        assert own_error <= rows[f"cycles_{scope}"]["error_p_mm"] * 1.02
    assert rows["own_steady_all"]["error_p_mm"] < 0.99 * rows["cycles_steady_all"]["error_p_mm"]
    check = found.cycle_checks[0]
    assert check["real_mm"] == pytest.approx(check["emulated_mm"], rel=0.05)


def test_one_and_two_workers_give_the_same_bits(plant, small):
    recording, signature, _ = plant.record(TRUTH, n_cycles=3)
    one, two = (
        fit_breath(recording, signature, plant.Model(workers=workers), small, 3)
        for workers in (1, 2)
    )
    for field in dataclasses.fields(FitResult):
        first, second = getattr(one, field.name), getattr(two, field.name)
        if isinstance(first, np.ndarray):
            assert np.array_equal(first, second, equal_nan=True), field.name
        elif field.name != "errors":
            assert first == second, field.name


def test_failing_runs_are_counted_and_do_not_stop_the_fit(plant, small):
    recording, signature, truth = plant.record(TRUTH, n_cycles=3)
    settings = dataclasses.replace(small, n_initial=48)
    found = fit_breath(recording, signature, plant.Model(fails_above=0.7), settings, 3)
    n_failed = int(np.isnan(found.trace_cost).sum())
    assert n_failed > 0
    assert f"{n_failed} of {len(found.trace_cost)} runs failed" in found.warnings
    assert len(found.run_levels) == len(found.trace_cost) - n_failed
    assert np.abs(found.levels - truth.mean(axis=0)).max() < 0.03


def test_too_few_good_runs_for_an_emulator_still_give_levels(plant, small):
    recording, signature, _ = plant.record(TRUTH, n_cycles=3)
    settings = dataclasses.replace(small, n_initial=8, n_evaluations=4)
    found = fit_breath(recording, signature, plant.Model(fails_above=0.7), settings, 3)
    assert found.cycle_how.startswith("not done")
    assert len(found.cycle_id) == 0
    assert found.cost < found.cost_still


def test_a_torso_that_never_runs_is_one_clear_line(plant, small):
    recording, signature, _ = plant.record(TRUTH, n_cycles=3)
    with pytest.raises(InputError, match=r"plant: fit: not one of 24 runs"):
        fit_breath(recording, signature, plant.Model(fails_above=-1.0), small, 3)


def test_stillness_is_warned_of_at_the_bounds_and_few_breaths_get_no_verdict(plant, small):
    recording, signature, _ = plant.record([0.2, 0.0, 0.0, 0.0], n_cycles=2, noise=0.0)
    found = fit_breath(recording, signature, plant.Model(), small, 3)
    assert any(line.startswith("abdomen is at its lower bound") for line in found.warnings)
    rows = {row["scope"]: row for row in found.errors}
    assert rows["cycles_all"]["verdict"] == "n = 2: no verdict under 5 breaths"
    assert not any(scope.startswith("heldout") for scope in rows)


def test_a_fit_survives_its_file(plant, small, tmp_path):
    recording, signature, _ = plant.record(TRUTH, n_cycles=2)
    settings = dataclasses.replace(small, n_evaluations=0)
    found = fit_breath(recording, signature, plant.Model(), settings, 3)
    assert found.stop is Stop.NO_SEARCH
    records.save(found, tmp_path / "fit.npz")
    again = records.load(FitResult, tmp_path / "fit.npz")
    assert again.stop is Stop.NO_SEARCH
    assert np.array_equal(again.run_displacement, found.run_displacement)
    assert again.errors[0]["scope"] == "signature_all"


def test_held_out_breaths_leave_no_trace_in_the_signature(plant):
    recording, signature, _ = plant.record(TRUTH, n_cycles=6, noise=0.0)
    ids, events = used_cycles(signature)
    left_out = np.array([1, 4])
    spoiled = recording.positions.copy()
    frames = np.arange(len(spoiled)) / recording.rate
    for k in left_out:
        spoiled[(frames >= events[k, 0]) & (frames < events[k, 2])] += 5.0
    other = dataclasses.replace(recording, positions=spoiled)
    clean = without_cycles(recording, signature, left_out)
    dirty = without_cycles(other, signature, left_out)
    assert np.array_equal(clean.mean, dirty.mean)
    assert clean.n_used == len(ids) - 2
    assert np.abs(clean.mean - signature.mean).max() < 2e-4


def test_signature_breath_does_not_repeat_its_first_frame(plant):
    _, signature, _ = plant.record(TRUTH, n_cycles=3, noise=0.0)
    breath = signature_breath(signature)
    assert len(breath.time) == len(signature.time) - 1
    start, turn = breath.at(np.array([0.0, breath.period]))
    assert np.allclose(start, turn)
