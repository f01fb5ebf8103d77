"""What is said of a fitted laugh: warnings, columns of calls.csv, volumes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pipeline.call_effort import PARAMETERS
from pipeline.laugh_fit import LaughFit
from pipeline.score import numbers
from sim.units import CUBIC_METRE_PER_LITRE


def bound_lines(fit: LaughFit) -> list[str]:
    """One line for every parameter and side: the calls in which it lies at that bound."""
    found: dict[str, list[str]] = {}
    for one in fit.calls:
        for line in one.fit.warnings:
            found.setdefault(line.split(" (")[0], []).append(str(one.number))
    return [f"{what} in call {', '.join(calls)}" for what, calls in sorted(found.items())]


def warnings_of(fit: LaughFit) -> list[str]:
    """What a person should know of a laugh."""
    litre = CUBIC_METRE_PER_LITRE
    out = bound_lines(fit)
    quiet = [str(c.number) for c in fit.calls if not np.isfinite(c.rms)]
    if quiet:
        out.append(
            f"calls {', '.join(quiet)} ask for less than {numbers()['quiet_call']:g} cmH2O:"
            " followed without a search, and no error is stated for them; the map 'power'"
            " (pressure.map) gives quiet calls more pressure"
        )
    for number, (need, begun) in enumerate(zip(fit.needed, fit.begun, strict=True), start=1):
        there = begun - fit.air.floor
        if need > there + 0.1 * litre:
            out.append(
                f"bout {number}: needs {need / litre:.1f} L and has {there / litre:.1f} L; lower"
                " pressure.intensity, or cut it in two in calls.csv"
            )
    return out


def call_columns(fit: LaughFit) -> dict[int, dict[str, Any]]:
    """Further columns of calls.csv by the number of the call; starts in the file's time."""
    out: dict[int, dict[str, Any]] = {}
    for one in fit.calls:
        values = dict(zip(PARAMETERS, one.fit.values.tolist(), strict=True))
        for name in ("expiratory_start_s", "diaphragm_start_s"):
            values[name] += fit.plan.origin
        out[one.number] = {
            "rms_normalised": f"{one.rms:.4f}" if np.isfinite(one.rms) else "",
            "evaluations": str(one.fit.evaluations),
            "seconds": f"{one.fit.seconds:.2f}",
            **{name: f"{value:.4f}" for name, value in values.items()},
            "tonic": f"{one.fit.tonic:.4f}",
            "at_bound": "; ".join(one.fit.warnings),
        }
    return out


def volumes_litre(values: Sequence[float]) -> list[float]:
    """Volumes in L."""
    return [round(v / CUBIC_METRE_PER_LITRE, 3) for v in values]
