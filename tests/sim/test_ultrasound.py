"""The dome as a beam sees it: depth along the beam, excursion of a dome that falls or tilts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sim.motion import Motion, rest_motion
from sim.resting import RestingTorso
from sim.ultrasound import dome_excursion, echo_depth, is_dome

SQUARE = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.fixture(scope="module")
def still(resting: RestingTorso) -> Motion:
    return rest_motion(resting, "upright")


def _moved(still: Motion, change: np.ndarray) -> Motion:
    dome = still.soft["diaphragm"]
    both = np.concatenate([dome.vertices, dome.vertices + change])
    markers = np.concatenate([still.markers, still.markers])
    soft = {**still.soft, "diaphragm": replace(dome, vertices=both)}
    return replace(still, soft=soft, markers=markers)


def test_depth_is_measured_along_the_beam() -> None:
    probe = np.array([0.25, 0.25, 0.0])
    toward = np.array([[0.25, 0.25, 0.5], [0.55, 0.25, 0.5], [5.0, 0.25, 1.0]])
    found = echo_depth(SQUARE, FACES, probe, toward)
    assert found[:2] == pytest.approx([1.0, np.hypot(1.0, 0.6)])
    assert np.isnan(found[2]), "a beam that misses has no echo"


def test_the_last_surface_is_the_echo() -> None:
    both = np.concatenate([SQUARE, SQUARE + np.array([0.0, 0.0, 1.0])])
    faces = np.concatenate([FACES, FACES + len(SQUARE)])
    found = echo_depth(both, faces, np.array([0.3, 0.3, 0.0]), np.array([[0.3, 0.3, 1.0]]))
    assert found == pytest.approx([2.0])


def test_a_still_dome_has_no_excursion(still: Motion) -> None:
    found = dome_excursion(_moved(still, np.zeros(3)), still, 0, 1)
    assert found == pytest.approx({"right": 0.0, "left": 0.0})


def test_a_falling_dome_comes_nearer_on_both_sides(still: Motion) -> None:
    found = dome_excursion(_moved(still, np.array([0.0, 0.0, -0.015])), still, 0, 1)
    assert found["right"] == pytest.approx(found["left"], rel=0.02)
    assert 0.010 < found["right"] < 0.025


def test_a_dome_that_tilts_backwards_shows_more_than_its_middle_falls(still: Motion) -> None:
    place = still.soft["diaphragm"].vertices[0]
    middle = place[is_dome(still), 0].mean()
    fall = np.zeros_like(place)
    fall[:, 2] = -0.015 + 0.2 * (place[:, 0] - middle)
    level = dome_excursion(_moved(still, np.array([0.0, 0.0, -0.015])), still, 0, 1)
    assert dome_excursion(_moved(still, fall), still, 0, 1)["right"] > 1.2 * level["right"]
