"""Figures of a run: swept volumes, rotations and breaths with a known answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sim.motion import Motion, rest_motion
from sim.physics.surface import enclosed_volume
from sim.resting import RestingTorso
from sim.summary import (
    compartments,
    dome_descent,
    find_breaths,
    rib_rotations,
    steadiness,
    summarise,
    swept_volume,
)

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
PERIOD = 4.0
RATE = 25.0


@pytest.fixture(scope="module")
def still(resting: RestingTorso) -> Motion:
    return rest_motion(resting, "upright")


def _breathing(still: Motion, n_breaths: int, drift: float = 0.0, tidal: float = 5e-4) -> Motion:
    """The resting torso repeated, with a lung volume of known breaths."""
    time = np.arange(1, round(n_breaths * PERIOD * RATE) + 1) / RATE
    n = len(time)
    lung = 3e-3 + 0.5 * tidal * (1.0 - np.cos(2.0 * np.pi * time / PERIOD)) + drift * time / PERIOD
    zero = np.zeros(n)
    return replace(
        still,
        time=time,
        position=np.repeat(still.position, n, axis=0),
        quaternion=np.repeat(still.quaternion, n, axis=0),
        soft={k: replace(s, vertices=np.repeat(s.vertices, n, axis=0))
              for k, s in still.soft.items()},
        markers=np.repeat(still.markers, n, axis=0),
        volumes={"lung": lung, "chest_cavity": lung + still.tissue_volume,
                 "abdomen": np.repeat(still.volumes["abdomen"], n)},
        pressures={"lung": zero, "pleural": zero - 490.33, "abdomen": zero + 980.665},
    )  # fmt: skip


@given(seed=st.integers(0, 1000))
@settings(max_examples=30)
def test_parts_sweep_what_the_whole_gains(seed: int) -> None:
    rng = np.random.default_rng(seed)
    moved = CUBE + 0.2 * rng.standard_normal(CUBE.shape)
    parts = swept_volume(CUBE, moved, FACES[:5]) + swept_volume(CUBE, moved, FACES[5:])
    gain = enclosed_volume(moved, FACES) - enclosed_volume(CUBE, FACES)
    assert parts == pytest.approx(gain, abs=1e-12)


def test_a_face_pushed_out_sweeps_its_prism() -> None:
    moved = CUBE.copy()
    moved[4:, 0] += 0.25
    assert swept_volume(CUBE, moved, FACES[2:4]) == pytest.approx(0.25)


def test_compartments_of_a_raised_chest(still: Motion) -> None:
    up, n_dome = np.array([0.0, 0.0, 0.01]), len(still.soft["diaphragm"].faces)
    dome = np.unique(still.soft["chest_cavity"].faces[-n_dome:])
    soft = {}
    for name, s in still.soft.items():
        shift = np.zeros_like(s.vertices[0])
        if name == "chest_cavity":
            shift[np.setdiff1d(np.arange(len(shift)), dome)] = up
        soft[name] = replace(s, vertices=np.stack([s.vertices[0], s.vertices[0] + shift]))
    moved = replace(still, soft=soft)
    found = compartments(moved, 0, 1)
    x, faces = soft["chest_cavity"].vertices, soft["chest_cavity"].faces
    gain = enclosed_volume(x[1], faces) - enclosed_volume(x[0], faces)
    assert found["rib_cage"] == pytest.approx(gain, rel=1e-9)
    assert found["belly"] == 0.0 and found["diaphragm"] == 0.0


def test_a_raised_rib_turns_positive_on_both_sides(still: Motion) -> None:
    turned = still.quaternion.copy()
    for letter, side in (("L", 1.0), ("R", -1.0)):
        b = still.bodies.index(f"rib_{letter}5")
        # front end up: X towards Z; side up: Y towards Z on the left, -Y towards Z on the right
        raised = Rotation.from_rotvec([side * 0.02, -0.03, 0.0])
        then = Rotation.from_quat(turned[0, b], scalar_first=True)
        turned[0, b] = (raised * then).as_quat(scalar_first=True)
    ribs = rib_rotations(replace(still, quaternion=turned), still, 0)
    for name in ("rib_L5", "rib_R5"):
        assert ribs[name] == pytest.approx({"pump": 0.03, "bucket": 0.02}, abs=1e-12)
    assert ribs["rib_L6"] == pytest.approx({"pump": 0.0, "bucket": 0.0}, abs=1e-12)
    assert len(ribs) == 24


def test_dome_descent_is_positive_downwards(still: Motion) -> None:
    dome = still.soft["diaphragm"]
    both = np.concatenate([dome.vertices, dome.vertices - [0.0, 0.0, 0.015]])
    moved = replace(still, soft={**still.soft, "diaphragm": replace(dome, vertices=both)})
    assert dome_descent(moved, still, 0, 1) == pytest.approx(0.015)


def test_breaths_are_found(still: Motion) -> None:
    moved = _breathing(still, 3)
    breaths = find_breaths(moved, PERIOD)
    assert len(breaths) == 3
    last = breaths[-1]
    assert moved.time[last.high] == pytest.approx(10.0)
    assert moved.time[last.low] == pytest.approx(8.0)
    assert moved.time[last.last] == pytest.approx(12.0)


def test_steps_left_over_at_the_end_lose_no_breath(still: Motion) -> None:
    # frames of three steps, and a run that ends two steps after the last of them
    moved = _breathing(still, 3)
    step = (moved.time[1] - moved.time[0]) / 3.0
    short = replace(moved, time=moved.time - 2.0 * step)
    assert len(find_breaths(short, PERIOD)) == 3
    assert len(find_breaths(moved.frames(0, len(moved.time) - 1), PERIOD)) == 2


@pytest.mark.parametrize(
    ("n_breaths", "drift", "steady", "word"),
    [(3, 0.0, True, ""), (3, 6e-6, False, "drifts 6.0 mL"), (1, 0.0, False, "one breath")],
)
def test_steadiness(still: Motion, n_breaths: int, drift: float, steady: bool, word: str) -> None:
    moved = _breathing(still, n_breaths, drift)
    found, _, why = steadiness(moved, find_breaths(moved, PERIOD))
    assert found is steady
    assert word in why and bool(why) is not steady


def test_a_changing_tidal_volume_is_not_steady(still: Motion) -> None:
    moved = _breathing(still, 3)
    lung = moved.volumes["lung"].copy()
    lung[200:] = lung[199] + 1.02 * (lung[200:] - lung[199])
    moved = replace(moved, volumes={**moved.volumes, "lung": lung})
    found, _, why = steadiness(moved, find_breaths(moved, PERIOD))
    assert not found and "tidal volume changes 2.0 %" in why


def test_figures_have_their_units(still: Motion) -> None:
    moved = _breathing(still, 3)
    # the chest must gain something for the shares to mean anything
    chest = moved.soft["chest_cavity"]
    moved = replace(
        moved,
        soft={**moved.soft, "chest_cavity": replace(chest, vertices=_swollen(chest.vertices))},
    )
    figures = summarise(moved, still, rate=1.0 / PERIOD)
    assert figures["tidal_volume_l"] == pytest.approx(0.5, rel=1e-3)
    assert figures["breaths_per_min"] == pytest.approx(15.0)
    assert figures["minute_ventilation_l_min"] == pytest.approx(7.5, rel=1e-3)
    assert figures["pleural_pressure_cmh2o"] == pytest.approx([-5.0, -5.0], rel=1e-3)
    assert figures["abdominal_pressure_cmh2o"] == pytest.approx([10.0, 10.0])
    assert figures["abdomen_volume_error"] == 0.0
    assert figures["end_expiratory_drift_ml"] == pytest.approx(0.0, abs=1e-6)
    assert figures["steady"] is True
    assert figures["rib_cage_share"] == pytest.approx(1.0)


def _swollen(vertices: np.ndarray) -> np.ndarray:
    n = len(vertices)
    swell = 1.0 + 0.01 * (1.0 - np.cos(2.0 * np.pi * np.arange(1, n + 1) / RATE / PERIOD))
    return np.asarray(vertices * swell[:, None, None])
