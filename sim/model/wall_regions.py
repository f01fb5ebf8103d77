"""The five regions of the abdominal wall that one level drives in proportion.

dilorenzo2009 section 3.2.3, after Hoit 1988. Where a region lies is a row of `wall_regions.csv`,
its share of the level the parameter `share_REGION`.
"""

from __future__ import annotations

from dataclasses import dataclass

from sim.errors import ParameterError
from sim.tables import Parameters


@dataclass(frozen=True, kw_only=True, slots=True)
class Region:
    """A part of the wall.

    Parameters
    ----------
    groups : muscle groups that it takes in
    top, bottom : how far down it goes from the costal margin (0) to the pelvis (1)
    share : of the level of the abdomen
    """

    name: str
    groups: frozenset[str]
    top: float
    bottom: float
    share: float


def read_regions(parameters: Parameters) -> list[Region]:
    """The regions with their shares in a parameter set."""
    return [
        Region(
            name=row["region"],
            groups=frozenset(row["groups"].split()),
            top=float(row["top"]),
            bottom=float(row["bottom"]),
            share=parameters[f"share_{row['region']}"],
        )
        for row in parameters.rows("wall_regions.csv")
    ]


def find_region(regions: list[Region], group: str, depth: float) -> Region:
    """The region in which an element of a group lies.

    Parameters
    ----------
    depth : of its middle, from the costal margin (0) to the pelvis (1)

    Raises
    ------
    ParameterError
        if none or several take it in
    """
    found = [r for r in regions if group in r.groups and r.top <= depth < r.bottom]
    if len(found) != 1:
        raise ParameterError(
            f"wall_regions.csv: {group} at depth {depth:.3g} lies in {len(found)} regions."
            " Let each group's regions follow on from 0 to 1."
        )
    return found[0]
