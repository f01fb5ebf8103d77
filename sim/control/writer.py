"""Write an XML control file; what is written is read back as it was."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

from sim.control.controls import Controls
from sim.control.curves import Curve, Linear, Sawtooth, Sine
from sim.writing import whole_file


def _element(tag: str, said: Mapping[str, object], *, close: bool) -> str:
    """A tag; attributes that are none or empty are left out."""
    words = [f"{k}={quoteattr(_text(v))}" for k, v in said.items() if v is not None and v != ""]
    return f"<{' '.join([tag, *words])}{' /' if close else ''}>"


def _text(value: object) -> str:
    # repr gives the shortest digits that are read back as the same number
    return repr(value) if isinstance(value, float) else str(value)


def _curve(curve: Curve) -> str:
    said: dict[str, object] = {"start": curve.start, "end": curve.end, "period": curve.period}
    if isinstance(curve, Sine):
        kind = "sine"
        said |= {"ampl": curve.amplitude, "offset": curve.offset}
    elif isinstance(curve, Linear):
        kind = "linear"
        said |= {"points": ", ".join(f"{t!r} {v!r}" for t, v in curve.points)}
    else:
        kind = "sawtooth" if isinstance(curve, Sawtooth) else "square"
        said |= {"high": curve.high, "low": curve.low}
        for name in ("rise", "hold", "release", "share"):
            said[name] = getattr(curve, name, None)
    return _element("curve", {"type": kind, **said, "phase": curve.phase}, close=True)


def _block(tag: str, said: Mapping[str, object], inside: list[str]) -> list[str]:
    lines = [f"    {line}" for line in inside]
    return [f"  {_element(tag, said, close=False)}", *lines, f"  </{tag}>"]


def format_controls(controls: Controls) -> str:
    """A control file as text."""
    c = controls
    root = {
        "version": "1", "name": c.name, "duration_s": c.duration, "step_s": c.step,
        "frames_per_s": c.frames, "cycle_s": c.cycle, "posture": c.posture,
        "values": "activation", "source": c.source, "note": c.note,
    }  # fmt: skip
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', _element("controls", root, close=False)]
    for spring in c.springs:
        said = {
            "name": spring.name,
            "values": spring.values if spring.values != "activation" else None,
            "alone": "true" if spring.alone else None,
            "source": spring.source,
            "note": spring.note,
        }
        lines += _block("spring", said, [_curve(curve) for curve in spring.curves])
    for spine in c.spines:
        said = {"name": spine.name, "joint": spine.joint, "source": spine.source}
        said["note"] = spine.note
        lines += _block("spine", said, [_curve(curve) for curve in spine.curves])
    if c.larynx is not None:
        shut = [_element("closed", {"start": a, "end": b}, close=True) for a, b in c.larynx.closed]
        said = {"source": c.larynx.source, "note": c.larynx.note}
        lines += _block("larynx", said, [*(_curve(k) for k in c.larynx.curves), *shut])
    return "\n".join([*lines, "</controls>", ""])


def write_controls(path: Path, controls: Controls) -> None:
    """Write a control file; it appears whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(format_controls(controls), encoding="utf-8")
