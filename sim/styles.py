"""Ways of breathing by themselves: timing and maximum levels from `sim/data/styles.csv`."""

from __future__ import annotations

import difflib
from dataclasses import dataclass

import numpy as np

from sim.breaths import sawtooth
from sim.errors import ParameterError
from sim.physics.types import Floats
from sim.simulate import LEVELS, group_activation
from sim.tables import Parameters, read_rows

RAMP = 0.1
"""Share of a manoeuvre's period over which an effort rises, and over which it is let go."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Style:
    """A way of breathing.

    Parameters
    ----------
    name : as typed
    shape : "tidal" (inspiration, expiration, pause) or "manoeuvre" (full expiration, then
        full inspiration, then let go)
    rate : breaths a second
    inspiration, pause : shares of the period
    levels : (4,), maximum levels in the order of `LEVELS`
    duration : s, of a run unless told otherwise
    """

    name: str
    shape: str
    rate: float
    inspiration: float
    pause: float
    levels: Floats
    duration: float

    @property
    def period(self) -> float:
        """Length of a breath, s."""
        return 1.0 / self.rate

    def activation(
        self, duration: float, step: float, parameters: Parameters | None = None
    ) -> Floats:
        """Activation of the muscle groups, (n_steps, n_groups).

        Parameters
        ----------
        duration, step : s
        parameters : that say which groups a level drives, the calibrated set unless given
        """
        time = np.arange(round(duration / step), dtype=float) * step
        inward, outward = self._tidal(time) if self.shape == "tidal" else self._manoeuvre(time)
        levels = np.stack([inward, inward, outward, outward], 1) * self.levels
        return group_activation(levels, parameters)

    def _tidal(self, time: Floats) -> tuple[Floats, Floats]:
        share = self.inspiration
        return sawtooth(
            time,
            inspiration=share * self.period,
            expiration=(1.0 - share) * self.period,
            pause=self.pause * self.period,
        )

    def _manoeuvre(self, time: Floats) -> tuple[Floats, Floats]:
        phase = np.mod(time * self.rate, 1.0)
        turn, end = 1.0 - self.inspiration - self.pause, 1.0 - self.pause
        outward = np.interp(phase, [0.0, RAMP, turn - RAMP, turn], [0.0, 1.0, 1.0, 0.0])
        inward = np.interp(phase, [turn, turn + RAMP, end, end + RAMP], [0.0, 1.0, 1.0, 0.0])
        return inward, outward


def read_styles() -> dict[str, Style]:
    """All styles by name."""
    return {
        row["style"]: Style(
            name=row["style"],
            shape=row["shape"],
            rate=float(row["breaths_per_min"]) / 60.0,
            inspiration=float(row["inspiration_share"]),
            pause=float(row["pause_share"]),
            levels=np.array([float(row[level]) for level in LEVELS]),
            duration=float(row["duration_s"]),
        )
        for row in read_rows("styles.csv")
    }


def find_style(name: str) -> Style:
    """Return the style called `name`.

    Raises
    ------
    ParameterError
        if there is none
    """
    styles = read_styles()
    if name not in styles:
        near = difflib.get_close_matches(name, styles, 1)
        hint = f" Did you mean {near[0]}?" if near else ""
        raise ParameterError(
            f"simulate: style '{name}' does not exist.{hint} There are: {', '.join(styles)}."
        )
    return styles[name]
