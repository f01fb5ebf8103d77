"""Names of what a control file can drive, and the muscle groups that each reaches."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from functools import cache

import numpy as np

from sim.errors import ParameterError
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.types import Floats
from sim.simulate import LEVELS
from sim.tables import read_rows


def unknown(what: str, name: str, known: Iterable[str]) -> ParameterError:
    """The complaint about a name that does not exist, with the nearest that does."""
    names = list(known)
    near = difflib.get_close_matches(name, names, 1)
    hint = f"Did you mean {near[0]}?" if near else f"There are: {', '.join(names)}."
    return ParameterError(f"{what} '{name[:40]}' does not exist. {hint}")


@cache
def group_members() -> dict[str, dict[str, float]]:
    """Groups of groups (`groups.csv`): the share of every member."""
    out: dict[str, dict[str, float]] = {}
    for row in read_rows("groups.csv"):
        out.setdefault(row["name"], {})[row["member"]] = float(row["share"])
    return out


def channel_names() -> tuple[str, ...]:
    """Every name that a `<spring>` may carry."""
    return tuple(dict.fromkeys([*LEVELS, *MUSCLE_GROUPS, *group_members()]))


def our_name(name: str) -> str:
    """Our name of a channel: a group of one whole member is another name of that member.

    Raises
    ------
    ParameterError
        if there is no such channel
    """
    if name not in channel_names():
        raise unknown("muscle group", name, channel_names())
    if name in LEVELS or name in MUSCLE_GROUPS:
        return name
    members = group_members()[name]
    return next(iter(members)) if list(members.values()) == [1.0] else name


def shares(name: str, *, alone: bool = False) -> Floats:
    """What a channel passes to the four levels and then to the muscle groups, (4 + n_groups,).

    A name that is both a level and a muscle group is the level, which takes its accessory muscles
    along, unless it is driven `alone`.
    """
    out = np.zeros(len(LEVELS) + len(MUSCLE_GROUPS))
    members = {name: 1.0}
    if name not in LEVELS and name not in MUSCLE_GROUPS:
        members = group_members()[name]
    for member, share in members.items():
        if member in LEVELS and not alone:
            out[LEVELS.index(member)] += share
        else:
            out[len(LEVELS) + MUSCLE_GROUPS.index(member)] += share
    return out
