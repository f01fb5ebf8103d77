"""What the torso is told over a whole recording, while it is being found; then a control file."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from sim.control.controls import Controls, Larynx, Spine, Spring
from sim.control.curves import Curve, Linear, Sine

TABLE = Path(__file__).parent / "tables" / "follow.csv"
LARYNX, FLEXION = "larynx", "flexion"
Point = tuple[float, float]


@cache
def numbers() -> dict[str, float]:
    """Numbers of tables/follow.csv."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        return {row["name"]: float(row["value"]) for row in csv.DictReader(file)}


def burst(start: float, period: float, height: float) -> Sine:
    """One period of a sine that begins and ends at nothing and reaches `height` in between.

    The published primitive (dilorenzo2009 section 6.3.2) is a period of a sine; a muscle cannot
    be less than silent, so ours stands on its own half height.

    Parameters
    ----------
    start, period : s
    height : activation
    """
    half = 0.5 * height
    return Sine(
        start=start,
        end=start + period,
        period=period,
        amplitude=half,
        offset=half,
        phase=-0.25 * period,
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class Score:
    """Lines and bursts of every channel, in the time of the control file.

    Parameters
    ----------
    lines : points (s, value) of a muscle level or group, of "larynx" (cmH2O s/L) or of "flexion"
        (degrees); straight between them and level outside
    bursts : sines of a channel, on top
    closed : start and end, s, of closures of the larynx
    """

    lines: Mapping[str, tuple[Point, ...]] = field(default_factory=dict)
    bursts: Mapping[str, tuple[Sine, ...]] = field(default_factory=dict)
    closed: tuple[Point, ...] = ()

    def line(self, channel: str, *points: Point) -> Score:
        """Go on with the line of a channel; a point at or before its last one replaces it."""
        kept = list(self.lines.get(channel, ()))
        for time, value in points:
            kept = [point for point in kept if point[0] < time - 1e-9]
            kept.append((float(time), float(value)))
        return replace(self, lines={**self.lines, channel: tuple(kept)})

    def add(self, channel: str, *sines: Sine) -> Score:
        """Add bursts to a channel; those of no height are left out."""
        more = (*self.bursts.get(channel, ()), *(s for s in sines if s.amplitude != 0.0))
        return replace(self, bursts={**self.bursts, channel: more})

    def shut(self, start: float, end: float) -> Score:
        """Close the larynx for a while."""
        return replace(self, closed=(*self.closed, (start, end)))

    def level(self, channel: str, default: float = 0.0) -> float:
        """Value of the last point of a line."""
        points = self.lines.get(channel, ())
        return points[-1][1] if points else default

    def between(self, start: float, end: float) -> Score:
        """The same between two times, s, without the bursts that do not reach there."""
        lines = {name: _near(points, start, end) for name, points in self.lines.items()}
        bursts = {
            name: tuple(s for s in sines if s.start < end and (s.end is None or s.end > start))
            for name, sines in self.bursts.items()
        }
        return replace(self, lines=lines, bursts=bursts)

    def controls(self, *, step: float, **about: object) -> Controls:
        """The control file.

        Parameters
        ----------
        step : s, of the simulation
        about : further fields of `Controls`
        """
        names = [n for n in dict.fromkeys([*self.lines, *self.bursts]) if self.curves(n)]
        springs = tuple(
            Spring(name=n, curves=self.curves(n)) for n in names if n not in (LARYNX, FLEXION)
        )
        spines = tuple(Spine(name=n, curves=self.curves(n)) for n in names if n == FLEXION)
        larynx = Larynx(curves=self.curves(LARYNX), closed=self.closed)
        told = larynx.curves or larynx.closed
        given = {"name": "score", **about}
        return Controls(
            springs=springs,
            spines=spines,
            larynx=larynx if told else None,
            step=step,
            **given,  # type: ignore[arg-type]
        )

    def curves(self, channel: str) -> tuple[Curve, ...]:
        """Curves of a channel; none for one that is not told anything."""
        points = self.lines.get(channel, ())
        line = (Linear(points=points),) if points else ()
        return (*line, *self.bursts.get(channel, ()))


def _near(points: tuple[Point, ...], start: float, end: float) -> tuple[Point, ...]:
    """Points that matter between two times: those within, one before and one after."""
    before = [k for k, (time, _) in enumerate(points) if time <= start]
    after = [k for k, (time, _) in enumerate(points) if time >= end]
    first = before[-1] if before else 0
    last = after[0] if after else len(points) - 1
    return points[first : last + 1]
