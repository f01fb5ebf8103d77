"""The library of behaviours: complete, within bounds, and as printed."""

from __future__ import annotations

import numpy as np
import pytest

from sim.breaths import sawtooth
from sim.control.library import FORMS, STYLES, behaviour_file, find_controls
from sim.control.reader import parse_controls, read_controls
from sim.control.writer import format_controls
from sim.errors import ParameterError
from sim.simulate import BREATH_STEP, group_activation

FILES = [(s, f) for f in FORMS for s in STYLES if (s, f) != ("vital_capacity", "papers")]


@pytest.mark.parametrize(("style", "form"), FILES)
def test_every_behaviour_can_be_run(style: str, form: str) -> None:
    controls = find_controls(style, form)
    assert controls.name == style and controls.source
    duration = controls.run_duration
    assert duration is not None and controls.run_cycle(duration) <= duration
    activation = controls.drive(duration).activation
    assert 0.0 <= activation.min() < activation.max() <= 1.0
    assert parse_controls(format_controls(controls).encode(), "again.xml") == controls


@pytest.mark.parametrize("style", ["cough", "sneeze"])
def test_printed_events_have_a_short_step(style: str) -> None:
    assert find_controls(style, "papers").run_step <= 1e-3


def test_no_other_style() -> None:
    with pytest.raises(ParameterError, match="Did you mean sneeze"):
        behaviour_file("sneze")
    with pytest.raises(ParameterError, match="vital_capacity has no form 'papers'"):
        behaviour_file("vital_capacity", "papers")
    with pytest.raises(ParameterError, match="style 'calm/x' does not exist"):
        behaviour_file("calm/x")


@pytest.mark.parametrize(
    ("style", "rate", "inspiration", "pause", "levels"),
    [
        ("calm", 14.0, 0.452, 0.10, [0.171, 0.0563, 0.0, 0.0]),
        ("deep", 7.4, 0.448, 0.05, [0.8, 0.4, 0.0, 0.0]),
    ],
)
def test_breaths_are_the_sawtooth_of_the_fit(
    style: str, rate: float, inspiration: float, pause: float, levels: list[float]
) -> None:
    period = 60.0 / rate
    found = find_controls(style).drive(2.5 * period).activation
    shape = sawtooth(
        np.arange(len(found)) * BREATH_STEP, inspiration=inspiration * period,
        expiration=(1.0 - inspiration) * period, pause=pause * period,
    )  # fmt: skip
    expected = group_activation(np.stack([shape[0]] * 2 + [shape[1]] * 2, 1) * np.array(levels))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def printed(style: str) -> dict[str, tuple[float, float]]:
    """Least and largest level of every spring of a printed form."""
    controls = read_controls(behaviour_file(style, "papers"))
    assert controls.run_duration is not None
    time = np.arange(round(controls.run_duration / 1e-3)) * 1e-3
    out = {}
    for spring in controls.springs:
        value = controls._value(spring, time)
        out[spring.name] = (float(value.min()), float(value.max()))
    return out


@pytest.mark.parametrize(
    ("style", "diaphragm", "middle", "swing"),
    [("calm", 0.85, 0.92, 0.08), ("deep", 0.80, 0.80, 0.20), ("panting", 0.80, 0.88, 0.12),
     ("forced_exhale", 0.80, 0.80, 0.20)],
)  # fmt: skip
def test_dilorenzo_table_5_1(style: str, diaphragm: float, middle: float, swing: float) -> None:
    found = printed(style)
    assert found["diaphragm"] == pytest.approx((0.0, 2.0 * (1.0 - diaphragm)))
    for layer in ("external_intercostals", "internal_intercostals"):
        low, high = 2.0 * (1.0 - middle - swing), 2.0 * (1.0 - middle + swing)
        assert found[layer] == pytest.approx((low, high), abs=1e-6)
    assert found.get("rectus", (0.0, 0.0))[1] == (1.0 if style == "forced_exhale" else 0.0)


@pytest.mark.parametrize(
    ("style", "diaphragm", "abdomen", "intercostals"),
    [("giggle", 0.05, 0.125, 0.2), ("laugh", 0.05, 0.5, 0.5), ("belly_laugh", 0.05, 1.0, 0.5)],
)
def test_dilorenzo_table_6_1(
    style: str, diaphragm: float, abdomen: float, intercostals: float
) -> None:
    found = printed(style)
    assert found["diaphragm"] == (diaphragm, diaphragm)
    assert found["abdomen"] == pytest.approx((0.0, abdomen))
    assert found["internal_intercostals"] == pytest.approx((0.0, intercostals))
    assert found["external_intercostals"] == pytest.approx((0.0, intercostals))


@pytest.mark.parametrize(
    ("style", "most"),
    [
        ("paradoxical_normal", {"diaphragm": 0.1, "external_intercostals": 0.3}),
        ("paradoxical", {"diaphragm": 0.1, "external_intercostals": 0.3, "abdomen": 0.1}),
        ("cough", {"diaphragm": 0.05, "external_intercostals": 1.0, "abdomen": 1.0,
                   "internal_intercostals": 1.0}),
        ("sneeze", {"diaphragm": 0.1, "external_intercostals": 0.2, "abdomen": 1.0,
                    "internal_intercostals": 0.8}),
    ],
)  # fmt: skip
def test_dilorenzo_table_7_1(style: str, most: dict[str, float]) -> None:
    found = {name: high for name, (_, high) in printed(style).items()}
    assert found == pytest.approx(most, abs=1e-6)
