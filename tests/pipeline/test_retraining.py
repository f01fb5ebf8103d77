"""Steps of a retraining: what they ask for, and that a torso is led to it; then a real torso."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from pipeline.places import default_config
from pipeline.retraining import Breathed, Pattern, alveolar_tidal, patterns, retrain
from pipeline.settings import RetrainingSettings

LITRE = 1e-3
OWN = Pattern(
    inspiration=2.0, expiration=3.0, pause=0.5, tidal=0.4 * LITRE, belly_share=0.45,
    expiratory=np.array([0.02, 0.04]),
)  # fmt: skip
GIVES = LITRE * np.array([[3.0, 1.2], [0.2, 4.0]])
"""Volume of rib cage and belly for the whole of external intercostals and diaphragm."""
LEVELS = np.array([0.06, 0.042, 0.02, 0.04])


@pytest.fixture(scope="module")
def defaults():
    text = default_config().read_text(encoding="utf-8")
    return RetrainingSettings(**yaml.safe_load(text)["retraining"])


def bent(asked, levels):
    """A torso with less and less to give, and more in a longer breath."""
    volumes = GIVES @ np.tanh(levels[:2]) * (1.0 - np.exp(-asked.inspiration))
    return Breathed(volumes=volumes, motion=None, figures={})


def own_of(play):
    done = play(OWN, LEVELS)
    return replace(OWN, tidal=done.tidal, belly_share=done.belly_share), done


def test_steps_go_evenly_from_the_own_breath_to_the_target(defaults):
    steps = patterns(OWN, defaults, 70.0)
    assert len(steps) == defaults.n_steps + 1 and steps[0] is OWN
    assert np.allclose([s.rate for s in steps], np.linspace(12.0, defaults.rate_per_min, 5))
    assert np.allclose([s.belly_share for s in steps], np.linspace(0.45, defaults.belly_share, 5))
    last = steps[-1]
    assert last.inspiration / last.period == pytest.approx(defaults.inspiration_share)
    assert last.expiratory == pytest.approx([0.0, 0.0])
    assert last.pause / last.expiration == pytest.approx(OWN.pause / OWN.expiration)


@given(
    tidal=st.floats(0.2e-3, 2e-3), rate=st.floats(8.0, 30.0), share=st.floats(0.3, 1.0),
    dead=st.floats(0.0, 0.19e-3),
)  # fmt: skip
def test_the_alveoli_get_as_much_air_at_any_rate(tidal, rate, share, dead):
    slower = share * rate
    more = alveolar_tidal(tidal, rate, slower, dead)
    assert (more - dead) * slower == pytest.approx((tidal - dead) * rate)
    assert more >= tidal * (1 - 1e-12)


def test_a_breath_of_dead_space_alone_keeps_its_volume():
    assert alveolar_tidal(0.1e-3, 30.0, 6.0, 0.15e-3) == 0.1e-3


def test_who_is_beyond_the_target_keeps_that(defaults):
    slow = replace(OWN, inspiration=6.0, expiration=9.0, belly_share=0.9)
    for step in patterns(slow, defaults, 70.0):
        assert step.rate == pytest.approx(4.0) and step.belly_share == pytest.approx(0.9)
        assert step.tidal == pytest.approx(slow.tidal)


def test_every_step_is_reached_within_the_tolerance_and_the_runs(defaults):
    own, done = own_of(bent)
    steps = retrain(bent, patterns(own, defaults, 70.0), LEVELS, done, defaults)
    assert np.array_equal(steps[0].levels, LEVELS)
    for step in steps[1:]:
        assert step.error <= defaults.tolerance
        assert step.n_runs <= defaults.n_runs
        miss = np.abs(bent(step.asked, step.levels).volumes - step.asked.volumes).max()
        assert miss / step.asked.tidal == pytest.approx(step.error)
        assert np.allclose(step.levels[2:], step.asked.expiratory)
    assert steps[-1].levels[1] > 1.5 * LEVELS[1]


def test_what_no_level_gives_is_told_as_an_error_and_levels_stay_in_bounds(defaults):
    own, done = own_of(bent)
    all_belly = replace(defaults, belly_share=0.95)
    last = retrain(bent, patterns(own, all_belly, 70.0), LEVELS, done, all_belly)[-1]
    assert last.levels[0] == 0.0 and 0.0 < last.levels[1] <= 1.0
    assert last.error > all_belly.tolerance
    assert last.breathed.belly_share < 0.9


@pytest.mark.parametrize(
    ("key", "value", "word"),
    [("n_steps", 0, "n_steps"), ("rate_per_min", 1.0, "rate"), ("belly_share", 1.0, "belly"),
     ("inspiration_share", 0.9, "inspiration"), ("frame_rate_hz", 5.0, "frame_rate")],
)  # fmt: skip
def test_settings_out_of_bounds_are_refused(defaults, key, value, word):
    with pytest.raises(ValueError, match=word):
        replace(defaults, **{key: value})


@pytest.mark.slow
def test_a_real_torso_is_led_to_a_slower_breath_of_the_belly(defaults, monkeypatch):
    from pipeline import retraining_stage
    from pipeline.model import TorsoModel
    from sim.model.torso import Subject

    model = TorsoModel(subject=Subject(sex="male", stature=1.756, mass=75.0), workers=1)
    names, unit = ("STRN", "NAVEL"), (1.0, 1.0, 1.0)
    landmarks = model.landmarks(unit, "upright")
    fit = _Fit(
        fit_scale=unit, posture="upright", labels=names, bend=(0.0, 0.0, 0.0),
        points=np.array([landmarks[name] for name in names]), levels=LEVELS,
        inspiration_time=1.2, expiration_time=1.8, pause_time=0.3,
    )  # fmt: skip
    monkeypatch.setattr(retraining_stage, "_model", lambda *_: model)
    monkeypatch.setattr(
        retraining_stage, "replace", lambda one, **new: _Fit(**{**vars(one), **new})
    )
    quick = replace(defaults, n_steps=1, n_runs=3, rate_per_min=12.0, belly_share=0.6)
    job = SimpleNamespace(section=lambda name: quick)
    play = retraining_stage._player(job, fit, 1)
    own = replace(OWN, inspiration=1.2, expiration=1.8, pause=0.3, expiratory=LEVELS[2:])
    done = play(own, LEVELS)
    own = replace(own, tidal=done.tidal, belly_share=done.belly_share)
    last = retrain(play, patterns(own, quick, 75.0), LEVELS, done, quick)[-1]
    assert last.error < 0.05
    assert last.breathed.belly_share == pytest.approx(0.6, abs=0.04)
    assert last.breathed.motion.elements is not None
    assert np.ptp(last.breathed.motion.time) == pytest.approx(5.0, abs=0.1)


class _Fit(SimpleNamespace):
    """What the kept breath needs of a fit."""

    def changed(self, **new):
        return _Fit(**{**vars(self), **new})
