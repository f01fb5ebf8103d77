"""The 3D viewer in a page: the scene, the script that plays it, and a picture in its place."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from markupsafe import Markup

from pipeline import page
from pipeline.draw.still import still_png
from pipeline.records import write_text
from pipeline.scene import Scene, build_scene
from sim.errors import InputError
from sim.motion import Motion
from sim.trajectory import load_motion

SCRIPT = Path(__file__).parent / "viewer" / "viewer.js"
MOST_BYTES = 8_000_000
"""Of a page."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Viewer:
    """What a template needs to show trajectories.

    Parameters
    ----------
    description, data : of the scene, safe inside script elements
    script : of the viewer; policy : what the page may run and play, for its security policy
    still : the picture without WebGL, sound : what leads the clock, if any, as data addresses
    sentences : what is told below the picture
    """

    description: Markup
    data: Markup
    script: Markup
    policy: str
    still: str
    sound: str
    sentences: tuple[str, ...]


@cache
def script() -> str:
    """Return the bundle, so that nothing in it ends the element that it stands in."""
    text = SCRIPT.read_text(encoding="utf-8").replace("</script", "<\\/script")
    return text.replace("<!--", "<\\!--")


@cache
def policy() -> str:
    """Return what the page's policy allows: this bundle, a sound inside the page, nothing else."""
    digest = hashlib.sha256(script().encode("utf-8")).digest()
    return f"script-src 'sha256-{base64.b64encode(digest).decode('ascii')}'; media-src data:"


def data_address(content: bytes, kind: str) -> str:
    """Return a file as an address that holds it; `kind` is its media type."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _sentences(scene: Scene, motion: Motion) -> tuple[str, ...]:
    told = [
        f"Every drawn point is within {scene.error_mm:.2f} mm of the simulated one: frames are"
        " stored in 16 bits, soft parts as principal components."
    ]
    if scene.rate < float("inf"):
        every = len(motion.time) / max(float(motion.time[-1] - motion.time[0]), 1e-9)
        fewer = " (fewer than the file)" if scene.rate < 0.9 * every else ""
        told.append(f"{scene.rate:.0f} frames a second are stored{fewer}, straight between them.")
    told.append("The skin is the outside of the simulated torso: no neck, no arms.")
    return tuple(told)


def _fullest(motion: Motion) -> int:
    return int(motion.volumes["lung"].argmax())


def make_viewer(
    motions: Mapping[str, Motion],
    *,
    place: str,
    facts: Sequence[str] = (),
    loop: bool = True,
    sound: str = "",
    span: tuple[float, float] | None = None,
) -> Viewer:
    """Make a viewer of one trajectory, or of several side by side.

    Parameters
    ----------
    motions : by the name that is shown
    place : file that an error names
    facts : short lines about what is shown
    loop : whether the motion repeats itself
    sound : data address of a sound that begins with the clock and leads it
    span : s, of the clock on the trajectories' own time; else each begins with its first frame
    """
    first = next(iter(motions.values()))
    scene = build_scene(motions, place=place, facts=facts, loop=loop, span=span)
    return Viewer(
        description=Markup(scene.description),
        data=Markup(scene.data),
        script=Markup(script()),
        policy=policy(),
        still=data_address(still_png(first, _fullest(first)), "image/png"),
        sound=sound,
        sentences=_sentences(scene, first),
    )


def _heading(about: Mapping[str, Any], path: Path) -> tuple[str, str]:
    words = [str(about[k]) for k in ("subject", "posture") if about.get(k)]
    return str(about.get("style") or about.get("recording") or path.stem), ", ".join(words)


def write_view(trajectory: Path, out: Path) -> Path:
    """Write a page that plays a trajectory.

    Parameters
    ----------
    trajectory : HDF5 file of `pleura simulate` or of a fit
    out : the page

    Raises
    ------
    InputError
        if the file is no trajectory, or too long for a page
    """
    motion, about = load_motion(trajectory)
    title, subtitle = _heading(about, trajectory)
    viewer = make_viewer({title: motion}, place=str(trajectory))
    text = page.render("view.html", title=title, subtitle=subtitle, viewer=viewer, about=about)
    if len(text) > MOST_BYTES:
        raise InputError(
            f"{trajectory}: the page would have {len(text) / 1e6:.0f} MB, more than"
            f" {MOST_BYTES / 1e6:.0f}. Simulate a shorter time."
        )
    write_text(out, text)
    return out
