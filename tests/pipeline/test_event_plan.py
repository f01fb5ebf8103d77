"""Bursts and phases of sounds that are no laughs, and the flow that they ask for."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.audio import Sound
from pipeline.event_plan import find_events
from pipeline.score import numbers
from sim.errors import InputError
from sim.units import CUBIC_METRE_PER_LITRE

RATE = 16000.0


def sound(level: np.ndarray, start: float = 0.0) -> Sound:
    rng = np.random.default_rng(4)
    samples = level * rng.normal(0.0, 0.1, len(level))
    return Sound(
        source="made.wav", rate=RATE, start=start, samples=samples, rectified=np.abs(samples),
        quality={}, warnings=(),
    )  # fmt: skip


def bumps(duration: float, *spans: tuple[float, float, float]) -> np.ndarray:
    time = np.arange(int(duration * RATE)) / RATE
    level = np.full(len(time), 1e-3)
    for start, end, height in spans:
        inside = (time >= start) & (time < end)
        level[inside] = height * np.sin(np.pi * (time[inside] - start) / (end - start))
    return level


def test_coughs_are_told_apart_and_the_loudest_has_the_usual_flow() -> None:
    level = bumps(3.0, (0.5, 0.8, 1.0), (1.2, 1.5, 0.4), (2.4, 2.7, 0.7))
    found = find_events(sound(level, start=10.0), "cough", 1.0)
    assert np.allclose([s for s, _ in found.spans], [10.5, 11.2, 12.4], atol=0.05)
    assert np.allclose([e for _, e in found.spans], [10.8, 11.5, 12.7], atol=0.05)
    top = numbers()["cough_flow"] * CUBIC_METRE_PER_LITRE
    assert found.flow.max() == pytest.approx(top)
    assert found.flow[(found.time > 11.9) & (found.time < 12.2)].max() == 0.0
    louder = find_events(sound(level), "cough", 1.5)
    assert louder.flow.max() == pytest.approx(1.5 * top)


def test_breaths_go_in_and_out_and_give_back_what_they_took() -> None:
    level = bumps(9.0, (0.5, 1.5, 1.0), (2.0, 3.5, 0.5), (4.5, 5.5, 1.0), (6.0, 7.5, 0.6))
    found = find_events(sound(level), "breath", 1.0)
    assert len(found.spans) == 4
    volumes = [found.volume(a, b) for a, b in found.spans]
    assert volumes[0] < 0 < volumes[1]
    assert volumes[1] == pytest.approx(-volumes[0], rel=0.02)
    assert volumes[3] == pytest.approx(-volumes[2], rel=0.02)


def test_a_click_is_no_cough() -> None:
    level = bumps(2.0, (0.5, 0.52, 1.0))
    with pytest.raises(InputError, match=r"made\.wav: no cough stands out"):
        find_events(sound(level), "cough", 1.0)
