"""Attributes of a control file's elements, and the curves that they describe."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from sim.control.channels import unknown
from sim.control.curves import Curve, Linear, Sawtooth, Sine, Square
from sim.errors import ParameterError

TIMES = ("start", "end", "phase")
CURVES: dict[str, tuple[type[Curve], tuple[str, ...]]] = {
    "sine": (Sine, ("period", "ampl", "amplitude", "offset")),
    "square": (Square, ("period", "high", "low", "ampl", "amplitude", "offset", "share")),
    "sawtooth": (
        Sawtooth,
        ("period", "high", "low", "ampl", "amplitude", "offset", "rise", "hold", "release"),
    ),
    "linear": (Linear, ("period", "points")),
}
"""Attributes of each type of curve besides `type` and `TIMES`."""


def check_names(what: str, said: Mapping[str, str], known: tuple[str, ...]) -> None:
    """Refuse attributes that do not exist."""
    for name in said:
        if name not in known:
            raise unknown(f"{what}: attribute", name, known)


def needed(said: Mapping[str, str], name: str) -> str:
    """An attribute that must be there."""
    if not said.get(name):
        raise ParameterError(f"has no {name}. Add it.")
    return said[name]


def choice(said: Mapping[str, str], name: str, known: tuple[str, ...], default: str) -> str:
    """An attribute that is one of a few words."""
    if name not in said:
        return default
    if said[name] not in known:
        raise unknown(name, said[name], known)
    return said[name]


def number(said: Mapping[str, str], name: str) -> float:
    """An attribute that is a finite number."""
    text = needed(said, name)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ParameterError(f"{name} is '{text[:40]}'. Give a number.")
    return value


def length(said: Mapping[str, str], name: str, low: float, high: float) -> float | None:
    """A positive number within bounds, or nothing if it is not said."""
    if name not in said:
        return None
    value = number(said, name)
    if not 0.0 < value or not low <= value <= high:
        wanted = f"{low:g} to {high:g}" if math.isfinite(high) else "more than 0"
        raise ParameterError(f"{name} is {value:g}. Give {wanted}.")
    return value


def read_points(text: str) -> tuple[tuple[float, float], ...]:
    """Points of a line from `time value, time value`."""
    out = []
    for pair in text.split(","):
        words = pair.split()
        if len(words) != 2:
            raise ParameterError(f"points: '{pair.strip()[:40]}' is no pair. Write 'time value'.")
        time, value = ({"points": word} for word in words)
        out.append((number(time, "points"), number(value, "points")))
    return tuple(out)


def read_curve(said: Mapping[str, str]) -> Curve:
    """A curve from the attributes of its element."""
    kind = needed(said, "type")
    if kind not in CURVES:
        raise unknown("curve type", kind, CURVES)
    make, own = CURVES[kind]
    check_names(kind, {k: "" for k in said if k != "type"}, (*TIMES, *own))
    if kind == "linear":
        numbers = {k: number(said, k) for k in said if k not in ("type", "points")}
        return Linear(points=read_points(needed(said, "points")), **numbers)
    numbers = {k: number(said, k) for k in said if k != "type"}
    needed(said, "period")
    if "ampl" in numbers:
        if "amplitude" in numbers:
            raise ParameterError("has ampl and amplitude, which are one. Leave one out.")
        numbers["amplitude"] = numbers.pop("ampl")
    if kind == "sine":
        needed({"ampl": "there"} if "amplitude" in numbers else {}, "ampl")
    else:
        numbers = _between(numbers)
    build: Callable[..., Curve] = make
    return build(**numbers)


def _between(numbers: dict[str, float]) -> dict[str, float]:
    """High and low of a square or sawtooth, also from offset and amplitude, as a sine has them."""
    if "amplitude" not in numbers:
        needed({k: "there" for k in numbers}, "high")
        if "offset" in numbers:
            raise ParameterError("has an offset without ampl. Give high and low.")
        return numbers
    if "high" in numbers or "low" in numbers:
        raise ParameterError("has high or low beside ampl. Give one or the other.")
    size, middle = numbers.pop("amplitude"), numbers.pop("offset", 0.0)
    return {**numbers, "high": middle + size, "low": middle - size}
