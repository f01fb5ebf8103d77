"""The first screen of a page: what it is, its result, and the figures that stand out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

Numbers = tuple[tuple[str, str], ...]
GOOD, BAD, PLAIN = "good", "bad", "plain"
"""How a result is marked: as asked for, not so, or neither."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Headline:
    """What a page says first, and what reports/index.html says of it.

    Parameters
    ----------
    kind : of the page, as a person calls it; title, subtitle : its own
    result : one sentence; mark : `GOOD`, `BAD` or `PLAIN`
    numbers : (value, label), the first of them also in the index
    sentences : more of the result
    made : when the figures were computed, `2026-01-31T12:00`, or nothing
    """

    kind: str
    title: str
    subtitle: str = ""
    result: str = ""
    mark: str = PLAIN
    numbers: Numbers = ()
    sentences: tuple[str, ...] = ()
    made: str = ""


def computed(records: Iterable[Mapping[str, Any]]) -> str:
    """When the last of the stages' records was written, to the minute; or nothing."""
    times = [str(r["run"]["finished"]) for r in records if r.get("run", {}).get("finished")]
    return max(times, default="")[:16]


def written(paths: Iterable[Path]) -> str:
    """When the last of the files was written, to the minute; or nothing."""
    times = [path.stat().st_mtime for path in paths if path.exists()]
    if not times:
        return ""
    return datetime.fromtimestamp(max(times), UTC).isoformat(timespec="minutes")[:16]
