"""Ribs, cartilages and sternum as one cage: what the intercostals move, the sternum follows."""

from __future__ import annotations

from types import ModuleType

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


@pytest.mark.parametrize("group", ["erector_spinae", "sternocleidomastoid"])
def test_accessory_muscles_are_recruited_late(group: str) -> None:
    levels = np.array([[0.05, 0.02, 0.0, 0.0], [0.9, 0.2, 0.0, 0.0]])
    quiet, deep = group_activation(levels)[:, MUSCLE_GROUPS.index(group)]
    assert quiet == 0.0
    assert deep > 0.1


def test_sternocleidomastoids_lift_the_sternum_and_fill_the_lung(resting: RestingTorso) -> None:
    activation = np.zeros((round(1.0 / BREATH_STEP), len(MUSCLE_GROUPS)))
    activation[:, MUSCLE_GROUPS.index("sternocleidomastoid")] = 0.5
    run = simulate(resting, activation, posture="upright", rate=10.0)
    bound = resting.bind(resting.landmarks("upright")["CLAV"][None], "upright")
    place = marker_places(bound, skin_frames(resting, run))[:, 0]
    assert place[-1, 2] > place[0, 2] + 0.001
    assert run.lung[-1] > run.lung[0] + 5e-5


def test_a_marker_above_the_notch_rides_on_the_manubrium(resting: RestingTorso) -> None:
    """Not on the thoracic inlet, which first ribs and manubrium only rim."""
    above = resting.landmarks("upright")["CLAV"] + [0.0, 0.0, 0.015]
    bound, skin = resting.bind(above[None], "upright"), resting.skin
    assert set(skin.body[bound.face[0]]) == {resting.torso.skeleton.body["sternum"]}
    # the inlet of a man is some 5 by 10 to 11 cm across
    x, inlet = resting.vertices("upright"), len(skin.faces) - len(skin.outside)
    lost = {tuple(face) for face in skin.faces} - {tuple(face) for face in skin.outside}
    assert len(lost) == inlet
    a, b, c = (x[[face[k] for face in lost]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert 3e-3 < area < 3e-2


def test_a_rib_alone_swings_as_its_closed_form(resting: RestingTorso, swinging: ModuleType) -> None:
    """Step (a) of the calibration; past its joint's limit another spring comes in."""
    assert swinging.rib_swing(resting).distance < 1e-3
    assert swinging.rib_swing(resting, start=0.1).distance > 0.3
