"""What a control file says, and what it does to a torso step by step."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from sim.control.channels import shares
from sim.control.curves import Curve, add_up, within
from sim.errors import ControlFileError, ParameterError
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.spine import joint_bend, spine_bend
from sim.physics.types import Floats
from sim.simulate import BREATH_STEP, LEVELS, group_activation
from sim.tables import Parameters
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

LEAST_RATIO = 0.5
"""Contraction ratio of a fully active muscle: the least that is printed (dilorenzo2009, Table 5.1),
and the length at which active force ends (its Fig. 4.2a)."""
MOST_RATIO = 1.5
"""The length at which active force ends on the other side."""
ROUNDING = 1e-9
CLOSED = 1e15
"""Pa s/m^3; through a closed larynx a litre a second would take ten billion atmospheres."""
FRAMES = 25.0
"""Frames a second to keep, unless a file says otherwise."""
BREATHS = 3
"""Cycles of a run whose file does not say how long it lasts."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Spring:
    """Curves that drive a muscle group.

    Parameters
    ----------
    name : one of `sim.control.channels.channel_names`
    curves : they add up
    values : "activation", or "contraction_ratio" as the papers' springs have it
    alone : drive the muscle group of that name without what its level takes along
    source, note : where the numbers come from
    line : of the file
    """

    name: str
    curves: tuple[Curve, ...]
    values: str = "activation"
    alone: bool = False
    source: str = ""
    note: str = ""
    line: int = field(default=0, compare=False)


@dataclass(frozen=True, kw_only=True, slots=True)
class Spine:
    """Curves that bend the back, degrees.

    Parameters
    ----------
    name : "flexion", "lateral" or "twist"
    joint : the upper part of a single joint; else the bend is shared out over all
    """

    name: str
    curves: tuple[Curve, ...]
    joint: str | None = None
    source: str = ""
    note: str = ""
    line: int = field(default=0, compare=False)


@dataclass(frozen=True, kw_only=True, slots=True)
class Larynx:
    """What the larynx adds to the resistance of the open airway, cmH2O s/L.

    Parameters
    ----------
    curves : they add up
    closed : start and end of each closure, s
    """

    curves: tuple[Curve, ...] = ()
    closed: tuple[tuple[float, float], ...] = ()
    source: str = ""
    note: str = ""
    line: int = field(default=0, compare=False)


class Drive(NamedTuple):
    """What `sim.simulate.simulate` is told, step by step."""

    activation: Floats
    """(n_steps, n_groups)"""
    larynx: Floats | None
    """(n_steps,), Pa s/m^3"""
    bend: Floats | None
    """(n_steps, 8, 3), rad"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Controls:
    """A control file.

    Parameters
    ----------
    name : of the behaviour
    duration, step : s, if the file says them
    frames : frames a second to keep
    cycle : s, length of a breath, or of the whole event
    posture : "upright" or "supine"
    springs, spines, larynx : what it drives
    place : file name for complaints
    """

    name: str
    springs: tuple[Spring, ...]
    spines: tuple[Spine, ...] = ()
    larynx: Larynx | None = None
    duration: float | None = None
    step: float | None = None
    frames: float | None = None
    cycle: float | None = None
    posture: str | None = None
    source: str = ""
    note: str = ""
    place: str = field(default="controls", compare=False)

    @property
    def run_step(self) -> float:
        """Step of the simulation, s."""
        return BREATH_STEP if self.step is None else self.step

    def at_step(self, step: float) -> Controls:
        """The same controls with another step of the simulation, s."""
        return replace(self, step=step)

    @property
    def run_frames(self) -> float:
        """Frames a second to keep."""
        return FRAMES if self.frames is None else self.frames

    @property
    def run_duration(self) -> float | None:
        """Length of a run, s: as said, else three cycles, else up to the last end."""
        if self.duration is not None:
            return self.duration
        ends = [c.end for s in self.springs for c in s.curves if c.end is not None]
        length = max([*ends, BREATHS * (self.cycle or self._longest() or 0.0)])
        return length or None

    def run_cycle(self, duration: float) -> float:
        """Length of a cycle, s: as said, else the longest period, else the whole run."""
        return self.cycle or self._longest() or duration

    def _longest(self) -> float | None:
        periods = [c.period for s in self.springs for c in s.curves if c.period is not None]
        return max(periods, default=None)

    def drive(
        self, duration: float, parameters: Parameters | None = None, *, start: float = 0.0
    ) -> Drive:
        """What the torso is told in a run of `duration`, s.

        Parameters
        ----------
        parameters : that say which groups a level drives, the calibrated set unless given
        start : s, where the run stands in the file; a piece is told the same as the whole, bit
            for bit

        Raises
        ------
        ControlFileError
            if a value leaves what a muscle, the back or the larynx can do
        """
        first = round(start / self.run_step)
        n = round(duration / self.run_step)
        time = np.arange(first, first + n, dtype=float) * self.run_step
        return Drive(self._activation(time, parameters), self._larynx(time), self._bend(time))

    def closed_time(self, duration: float) -> float:
        """Time for which the larynx stays closed at the longest in a run, s."""
        spans = self.larynx.closed if self.larynx else ()
        return max((min(end, duration) - start for start, end in spans if start < duration),
                   default=0.0)  # fmt: skip

    def _activation(self, time: Floats, parameters: Parameters | None) -> Floats:
        reached = np.zeros((len(time), len(LEVELS) + len(MUSCLE_GROUPS)))
        for spring in self.springs:
            value = self._value(spring, time)
            reached += value[:, None] * shares(spring.name, alone=spring.alone)
        out = group_activation(reached[:, : len(LEVELS)], parameters) + reached[:, len(LEVELS) :]
        names = (*LEVELS, *MUSCLE_GROUPS)
        for k, name in enumerate(names):
            total = reached[:, k] if k < len(LEVELS) else out[:, k - len(LEVELS)]
            what = f"{name} is driven by several springs: their activation"
            self._check(what, total, (0.0, 1.0), "", time, self.springs[0].line)
        return np.asarray(np.clip(out, 0.0, 1.0))

    def _value(self, spring: Spring, time: Floats) -> Floats:
        """Activation that a spring asks for, (n,)."""
        value, what = add_up(spring.curves, time), f"spring {spring.name}"
        if spring.values == "activation":
            self._check(f"{what}: activation", value, (0.0, 1.0), "", time, spring.line)
            return value
        on = np.zeros(len(time), dtype=bool)
        for curve in spring.curves:
            on |= within(curve, time)
        ratio = np.where(on, value, 1.0)
        span = (LEAST_RATIO, MOST_RATIO)
        self._check(f"{what}: contraction ratio", ratio, span, "", time, spring.line)
        # a muscle can shorten, not push: beyond its rest length a ratio asks for nothing
        return np.asarray(np.clip((1.0 - ratio) / (1.0 - LEAST_RATIO), 0.0, 1.0))

    def _larynx(self, time: Floats) -> Floats | None:
        if self.larynx is None:
            return None
        value = add_up(self.larynx.curves, time)
        self._check("larynx: resistance", value, (0.0, np.inf), " cmH2O s/L", time,
                    self.larynx.line)  # fmt: skip
        out = np.maximum(value, 0.0) * PASCAL_PER_CMH2O / CUBIC_METRE_PER_LITRE
        for start, end in self.larynx.closed:
            out[(time >= start) & (time < end)] = CLOSED
        return out

    def _bend(self, time: Floats) -> Floats | None:
        out = None
        for spine in self.spines:
            angle = np.radians(add_up(spine.curves, time))
            try:
                if spine.joint is None:
                    turns = spine_bend(**{spine.name: angle})
                else:
                    turns = joint_bend(spine.joint, spine.name, angle)
            except ParameterError as error:
                raise ControlFileError(f"{self.place}:{spine.line}: {error}") from error
            out = turns if out is None else out + turns
        return out

    def _check(self, what: str, value: Floats, span: tuple[float, float], unit: str,
               time: Floats, line: int) -> None:  # fmt: skip
        """Refuse values outside `span`; `line` is that of the element."""
        low, high = span
        over = (value < low - ROUNDING) | (value > high + ROUNDING)
        if not over.any():
            return
        worst = int(np.argmax(np.maximum(low - value, value - high)))
        wanted = f"{low:g} or more" if np.isinf(high) else f"{low:g} to {high:g}"
        raise ControlFileError(
            f"{self.place}:{line}: {what} is {value[worst]:.4g}{unit} at {time[worst]:.3g} s."
            f" Keep the sum of its curves within {wanted}."
        )
