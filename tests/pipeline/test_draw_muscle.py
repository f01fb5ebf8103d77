"""Figures of the muscle comparison: whole SVG files with units on their axes."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from pipeline.draw.muscle import convergence_svg, curves_svg, filmstrip_svg, motion_svg
from sim.muscle_comparison import Comparison, compare_laws


@pytest.fixture(scope="module")
def compared() -> Comparison:
    return compare_laws()


def words(svg: str) -> str:
    return " ".join(ElementTree.fromstring(svg).itertext())


def test_motions_name_their_laws_and_units(compared: Comparison) -> None:
    text = words(motion_svg(compared.activation, marks={1.0: "full activation"}, span=9.0))
    for part in ("tension, N", "height of the particle, m", "time, s", "full activation"):
        assert part in text
    assert "spring" in text and "Hill, as printed" in text


def test_frames_count_from_the_event(compared: Comparison) -> None:
    both = {law: compared.release[law] for law in ("spring", "hill")}
    text = words(filmstrip_svg(both, [0.5, 0.7], since=0.5))
    assert "0 ms" in text and "200 ms" in text and "height, m" in text


def test_curves_and_convergence(compared: Comparison) -> None:
    assert "force over isometric" in words(curves_svg(compared.curves))
    text = words(convergence_svg(compared.convergence))
    assert "step, ms" in text and "linearly implicit: order" in text


def test_the_same_comparison_gives_the_same_file(compared: Comparison) -> None:
    assert curves_svg(compared.curves) == curves_svg(compared.curves)
