"""Intervals that must hold the planted truth, and the reasons for giving none."""

import dataclasses

import numpy as np
import pytest

from pipeline.fit import fit_breath
from pipeline.inference_data import read_draws, to_inference_data, write_netcdf
from pipeline.intervals import bounded_interval, identifiability, shortest_interval
from pipeline.likelihood import effective_values
from pipeline.model import GROUPS
from pipeline.sampling import sample
from pipeline.uncertainty import NO_INTERVAL, OK, sample_posterior

TRUTH = np.array([0.30, 0.15, 0.05, 0.0])


@pytest.fixture(scope="module")
def quick(fit_settings, posterior_settings):
    """Settings with few runs and short chains."""
    fit = dataclasses.replace(
        fit_settings,
        n_initial=32,
        n_evaluations=16,
        heldout_every=0,
        n_cycle_checks=0,
        marker_radius_m=0.0,
        frame_rate_hz=10.0,
    )
    posterior = dataclasses.replace(
        posterior_settings, n_design=64, n_rounds=1, n_ensembles=2, n_walkers=16, n_draws=1000
    )
    return fit, posterior


@pytest.fixture(scope="module")
def fitted(plant, quick):
    """One fit of a recording whose breaths differ: recording, signature, levels, fit."""
    recording, signature, levels = plant.record(TRUTH, jitter=0.04, level_jitter=0.02, n_cycles=7)
    return (
        recording,
        signature,
        levels,
        fit_breath(recording, signature, plant.Model(), quick[0], 1),
    )


def planted(plant, quick, seed=1, truth=TRUTH, **options):
    recording, signature, levels = plant.record(truth, seed=seed, **options)
    model = plant.Model()
    found = fit_breath(recording, signature, model, quick[0], seed)
    return levels, sample_posterior(found, recording, signature, model, quick[1], seed)


def test_shortest_interval_of_an_exponential_starts_at_zero():
    draws = np.random.default_rng(1).exponential(size=100_000)
    low, high = shortest_interval(draws, 0.9)
    assert low < 1e-3
    assert high == pytest.approx(np.log(10), rel=0.02)


def test_shortest_interval_of_a_normal_is_central():
    low, high = shortest_interval(np.random.default_rng(1).normal(size=100_000), 0.9)
    assert (low, high) == pytest.approx((-1.645, 1.645), abs=0.08)


def test_an_interval_beside_a_bound_is_drawn_to_it():
    draws = np.random.default_rng(1).uniform(0.004, 0.3, size=10_000)
    assert bounded_interval(draws, 0.99, 1.0)[0] == 0.0


def test_white_noise_counts_every_value_and_a_smooth_curve_few():
    rng = np.random.default_rng(2)
    white = rng.normal(size=(400, 12))
    assert effective_values(white) == pytest.approx(4800, rel=0.3)
    time = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    one_curve = np.sin(time)[:, None] * rng.normal(size=(1, 12))
    assert effective_values(one_curve) < 10


def test_slow_noise_counts_by_its_autocorrelation():
    rng = np.random.default_rng(3)
    white = rng.normal(size=(2000, 8))
    window = np.exp(-np.arange(2000) / 10.0)
    slow = np.fft.irfft(np.fft.rfft(white, axis=0) * np.fft.rfft(window)[:, None], n=2000, axis=0)
    # an exponential autocorrelation of 10 frames has an integrated time of about 20
    assert effective_values(slow) == pytest.approx(2000 * 8 / 20, rel=0.35)


def test_the_sampler_finds_a_known_normal():
    scale = np.array([1.0, 0.1, 3.0])
    rng = np.random.default_rng(4)
    starts = [scale * rng.normal(size=(24, 3)) for _ in range(3)]
    chains = sample(
        lambda x: -0.5 * np.sum((x / scale) ** 2, axis=1),
        starts,
        9,
        max_steps=3000,
        min_taus=50,
        n_draws=4000,
    )
    assert chains.converged
    assert np.allclose(chains.draws.reshape(-1, 3).std(axis=0), scale, rtol=0.1)
    assert chains.r_hat.max() < 1.02


def test_a_chain_that_is_too_short_says_so():
    rng = np.random.default_rng(4)
    starts = [rng.normal(size=(24, 3)) for _ in range(2)]
    chains = sample(
        lambda x: -0.5 * np.sum(x**2, axis=1), starts, 9, max_steps=60, min_taus=50, n_draws=10
    )
    assert not chains.converged
    assert chains.words.startswith("NOT converged")


def test_words_name_groups_that_cannot_be_told_apart():
    rng = np.random.default_rng(5)
    first = rng.uniform(0.1, 0.4, size=5000)
    other = 0.5 - first + 0.01 * rng.normal(size=5000)
    draws = np.column_stack([first, other, rng.uniform(size=5000), 0.01 * rng.random(5000)])
    lines = identifiability(draws, GROUPS, 1.0)
    assert len(lines) == 2
    assert "nothing about the internal intercostals" in lines[0]
    assert "cannot tell the external intercostals from the diaphragm" in lines[1]


def test_planted_levels_lie_in_the_intervals(plant, quick, fitted):
    recording, signature, levels, fit = fitted
    found = sample_posterior(fit, recording, signature, plant.Model(), quick[1], 1)
    assert found.status == OK
    assert found.converged
    assert found.emulator_share < 0.2
    assert found.noise >= 1e-4
    rows = {(row["scope"], row["id"], row["group"]): row for row in found.activations}
    assert {scope for scope, _, _ in rows} == {"subject_mean", "next_breath", "cycle"}
    for group, truth in zip(GROUPS, levels.mean(axis=0), strict=True):
        row = rows["subject_mean", "plant", group]
        assert row["low"] <= truth <= row["high"]
        assert 0 < row["high"] - row["low"] < 0.1
        following = rows["next_breath", "plant", group]
        assert following["high"] - following["low"] >= 0.99 * (row["high"] - row["low"])
    held = [
        rows["cycle", str(k), group]["low"] <= truth <= rows["cycle", str(k), group]["high"]
        for k, own in enumerate(levels)
        for group, truth in zip(GROUPS, own, strict=True)
    ]
    assert np.mean(held) > 0.8


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(plant, quick):
    rng = np.random.default_rng(11)
    held = []
    for seed in range(15):
        truth = rng.uniform(0, 1, size=4) ** 2 * 0.6
        _, found = planted(plant, quick, seed=seed, truth=truth, n_cycles=4)
        assert found.status == OK
        rows = [row for row in found.activations if row["scope"] == "subject_mean"]
        held += [row["low"] <= t <= row["high"] for row, t in zip(rows, truth, strict=True)]
    assert 0.8 <= np.mean(held) <= 1.0


def test_a_poor_emulator_gives_no_interval_and_the_reason(plant, quick, fitted, tmp_path):
    recording, signature, _, fit = fitted
    strict = dataclasses.replace(quick[1], max_emulator_share=1e-12, n_design=0)
    found = sample_posterior(fit, recording, signature, plant.Model(), strict, 1)
    assert found.status == NO_INTERVAL
    assert "residual variance" in found.why
    assert {row["low"] for row in found.activations} == {""}
    write_netcdf(found, tmp_path / "posterior.nc")
    assert (tmp_path / "posterior.nc").stat().st_size > 0


def test_same_seed_same_draws_with_one_and_two_workers_and_through_the_file(
    plant, quick, fitted, tmp_path
):
    short = dataclasses.replace(quick[1], max_steps=250, n_design=60)
    recording, signature, _, fit = fitted
    first, second = (
        sample_posterior(fit, recording, signature, plant.Model(workers=workers), short, 3)
        for workers in (1, 2)
    )
    assert first.n_runs == 60
    assert np.array_equal(first.draws, second.draws)
    assert list(to_inference_data(first).posterior["level"].coords["group"].values) == list(GROUPS)
    write_netcdf(first, tmp_path / "posterior.nc")
    assert np.array_equal(read_draws(tmp_path / "posterior.nc"), first.draws)


def test_two_breaths_tell_nothing_of_the_next(plant, quick):
    short = (quick[0], dataclasses.replace(quick[1], max_steps=250, n_design=0))
    _, found = planted(plant, short, n_cycles=2)
    assert {row["scope"] for row in found.activations} == {"subject_mean", "cycle"}
