"""Figures of the validation: relaxation curves and transdiaphragmatic pressure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.draw.figure import ACCENT, FAINT, MEASURED, SIMULATED, as_svg, panels

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class Measured:
    """A published value with its range at a lung volume.

    Parameters
    ----------
    volume : L
    low, high : cmH2O
    label : what is written beside it, once a figure
    """

    volume: float
    low: float
    high: float
    label: str


@dataclass(frozen=True, kw_only=True, slots=True)
class Curves:
    """What is drawn of one person; volumes in L, pressures in cmH2O.

    Parameters
    ----------
    title : who
    volume, wall, lung : (n,), relaxed chest wall and lung
    capacity : RV, FRC, TLC as predicted
    effort_volume, effort : (m,), the diaphragm's maximum with the ribs held, lung filled passively
    active_volume, active : (k,), the same after an active inspiration
    statics, efforts : published values beside the two
    """

    title: str
    volume: Floats
    wall: Floats
    lung: Floats
    capacity: Sequence[float]
    effort_volume: Floats
    effort: Floats
    active_volume: Floats
    active: Floats
    statics: Sequence[Measured]
    efforts: Sequence[Measured]


def rahn_svg(people: Sequence[Curves]) -> str:
    """Lung volume against pressure: relaxed chest wall, lung and both, a panel a person."""
    figure, axes = panels(1, len(people), width=8.4, height=3.8)
    for axis, person in zip(axes, people, strict=True):
        both = person.wall + person.lung
        curves = (("chest wall", person.wall, SIMULATED), ("lung", person.lung, ACCENT),
                  ("together", both, FAINT))  # fmt: skip
        for label, pressure, colour in curves:
            seen = pressure < 50.0
            axis.plot(pressure[seen], person.volume[seen], "-", color=colour, label=label)
        _spans(axis, person.statics, sideways=True)
        for name, at in zip(("RV", "FRC", "TLC"), person.capacity, strict=True):
            axis.axhline(at, color=FAINT, lw=0.6, zorder=0)
            axis.text(49.0, at, name, fontsize=7, va="bottom", ha="right", color="#5c666e")
        axis.axvline(0.0, color=FAINT, lw=0.6, zorder=0)
        axis.set(title=person.title, xlabel="pressure (cmH2O)", xlim=(-40, 50), ylim=(0, None))
    axes[0].set_ylabel("lung volume (L)")
    axes[0].legend(fontsize=7, loc="upper left")
    return as_svg(figure)


def diaphragm_svg(people: Sequence[Curves]) -> str:
    """Maximal transdiaphragmatic pressure against lung volume, ribs held, a panel a person."""
    figure, axes = panels(1, len(people), width=8.4, height=3.4)
    for axis, person in zip(axes, people, strict=True):
        axis.plot(person.effort_volume, person.effort, "o-", color=SIMULATED, ms=4,
                  label="ribs held, lung filled passively")  # fmt: skip
        axis.plot(person.active_volume, person.active, "o--", color=ACCENT, ms=4,
                  label="ribs held, after an active inspiration")  # fmt: skip
        _spans(axis, person.efforts, sideways=False)
        axis.set(title=person.title, xlabel="lung volume (L)", ylim=(0, 220))
    axes[0].set_ylabel("transdiaphragmatic pressure (cmH2O)")
    axes[0].legend(fontsize=7, loc="lower left")
    return as_svg(figure)


def _spans(axis: object, spans: Sequence[Measured], *, sideways: bool) -> None:
    """Published ranges as bars with caps, named once each."""
    for span in spans:
        middle, half = 0.5 * (span.low + span.high), 0.5 * (span.high - span.low)
        at = (middle, span.volume) if sideways else (span.volume, middle)
        spread = {"xerr": half} if sideways else {"yerr": half}
        axis.errorbar(*at, **spread, fmt="s", ms=3.5, capsize=3, lw=1.0,  # type: ignore[attr-defined]
                      color=MEASURED, label=span.label)  # fmt: skip
