"""Ribs, cartilages and sternum as one cage: what the intercostals move, the sternum follows."""

from __future__ import annotations

import numpy as np
import pytest

from sim.model.anatomy import rib_tilts
from sim.model.landmarks import marker_places
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.simulate import BREATH_STEP, LEVELS, group_activation, simulate, skin_frames

EFFORT = {"external_intercostals": 0.2, "diaphragm": 0.05}


@pytest.fixture(scope="module")
def held(resting: RestingTorso) -> dict[str, Floats]:
    """How far landmarks are, m, after 2 s of an effort that rises for one and stays."""
    levels = np.array([EFFORT.get(name, 0.0) for name in LEVELS])
    time = np.arange(round(2.0 / BREATH_STEP)) * BREATH_STEP
    run = simulate(
        resting,
        group_activation(np.minimum(time, 1.0)[:, None] * levels),
        posture="upright",
        rate=10.0,
    )
    at = resting.landmarks("upright")
    names = list(at)
    bound = resting.bind(np.array(list(at.values())), "upright")
    places = marker_places(bound, skin_frames(resting, run))
    return dict(zip(names, places[-1] - places[0], strict=True))


def test_the_sternum_follows_the_ribs(held: dict[str, Floats]) -> None:
    # De Groote 1997: cartilages and sternum rise by 3 to 5 mm together in a quiet breath
    for name in ("CLAV", "STRN", "XIPH"):
        assert 0.4 < held[name][2] / held["LUCH"][2] < 1.5


def test_the_sternum_is_pushed_forwards_and_up(held: dict[str, Floats]) -> None:
    assert held["STRN"][0] > 0.0
    assert held["STRN"][2] > 0.001


def test_both_sides_move_alike(held: dict[str, Floats]) -> None:
    for left, right in (("LUCH", "RUCH"), ("LMCH", "RMCH"), ("LCOS", "RCOS")):
        mirrored = held[right] * [1.0, -1.0, 1.0]
        assert np.linalg.norm(held[left] - mirrored) < 0.25 * np.linalg.norm(held[left])


def test_a_bar_bends_as_a_cantilever(resting: RestingTorso) -> None:
    torso, links = resting.torso, resting.torso.plant.links
    p, sternum = torso.parameters, torso.skeleton.body["sternum"]
    bars = {}
    for e, b in enumerate(links.b):
        owner = torso.plant.point_body[links.a[e]]
        if torso.plant.point_body[b] == sternum:
            bars[owner] = links.across[e]
    for rib in range(2, 8):
        length = np.linalg.norm(torso.anatomy.facet[0, rib - 1] - torso.anatomy.rib[0, rib - 1, -1])
        rigidity = 3.0 * p["cartilage_modulus"] * p["cartilage_second_moment"]
        assert bars[torso.skeleton.body[f"rib_L{rib}"]] == pytest.approx(rigidity / length**3)


def test_ribs_slope_more_from_the_fourth_to_the_tenth(resting: RestingTorso) -> None:
    ribs = resting.torso.anatomy.rib[0]
    drop = np.array([np.arctan2(r[0, 2] - r[-1, 2], r[-1, 0] - r[0, 0]) for r in ribs])
    assert (np.diff(drop[3:10]) > -0.01).all()
    assert np.degrees(rib_tilts()).min() > 10.0


def test_accessory_muscles_are_recruited_late() -> None:
    extensor = MUSCLE_GROUPS.index("erector_spinae")
    quiet, deep = group_activation(np.array([[0.05, 0.02, 0.0, 0.0], [0.9, 0.2, 0.0, 0.0]]))
    assert quiet[extensor] == 0.0
    assert deep[extensor] > 0.1
