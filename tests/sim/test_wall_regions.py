"""Five regions of the abdominal wall: every element in one, their shares from the parameters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.errors import ParameterError
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import Subject, build_torso
from sim.model.wall_regions import Region, find_region, read_regions
from sim.tables import Parameters, parameters

MAN = Subject(sex="male", stature=1.756, mass=75.0)
WALL = ("rectus", "external_oblique", "internal_oblique", "transversus")
REGIONS = read_regions(parameters())


def wall_shares(p: Parameters) -> dict[str, np.ndarray]:
    muscles = build_torso(MAN, parameters=p).plant.muscles
    return {g: muscles.share[muscles.group == MUSCLE_GROUPS.index(g)] for g in WALL}


def test_five_regions_as_the_papers_count() -> None:
    assert [r.name for r in REGIONS] == [
        "upper_midline", "middle_midline", "lower_midline", "upper_lateral", "lower_lateral",
    ]  # fmt: skip


@given(depth=st.floats(0.0, 1.0, exclude_max=True), group=st.sampled_from(WALL))
def test_every_place_of_a_muscle_lies_in_one_region(depth: float, group: str) -> None:
    region = find_region(REGIONS, group, depth)
    assert region.top <= depth < region.bottom
    assert region.name.endswith("midline") == (group == "rectus")


def test_a_gap_between_regions_is_refused() -> None:
    half = Region(name="x", groups=frozenset({"rectus"}), top=0.0, bottom=0.5, share=1.0)
    with pytest.raises(ParameterError, match=r"rectus at depth 0\.7 lies in 0 regions"):
        find_region([half], "rectus", 0.7)
    with pytest.raises(ParameterError, match="lies in 2 regions"):
        find_region([half, half], "rectus", 0.2)


def test_calibrated_regions_leave_the_ratio_to_the_layers() -> None:
    assert all((share == 1.0).all() for share in wall_shares(parameters()).values())


def test_a_share_scales_the_elements_of_its_region_only() -> None:
    changed = wall_shares(parameters().replace(share_lower_lateral=0.5, share_upper_midline=0.2))
    for group in WALL[1:]:
        below = changed[group] == 0.5
        assert 0 < below.sum() < len(below)
        assert (changed[group][~below] == 1.0).all()
    assert set(changed["rectus"]) == {0.2, 1.0}


def test_papers_order_of_the_regions_is_that_of_hoit_1988() -> None:
    share = {r.name: r.share for r in read_regions(parameters("papers"))}
    assert share["lower_lateral"] > share["upper_lateral"]
    assert share["upper_lateral"] > max(v for k, v in share.items() if k.endswith("midline"))
