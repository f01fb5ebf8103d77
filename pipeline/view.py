"""The 3D viewer in a page: the scene, the script that plays it, and a picture in its place."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from pipeline import page
from pipeline.citations import citations
from pipeline.draw.still import still_png
from pipeline.headline import Headline, written
from pipeline.records import write_text
from pipeline.scene import Scene, build_scene
from sim.errors import InputError
from sim.motion import Motion
from sim.trajectory import load_motion

SCRIPT = Path(__file__).parent / "viewer" / "viewer.js"
MOST_BYTES = 8_000_000
"""Of a page."""
MOST_BESIDE = 4
"""Runs side by side; more are too small to be seen."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Viewer:
    """What a template needs to show trajectories.

    Parameters
    ----------
    description, data : of the scene, safe inside script elements
    script : of the viewer; digest : by which the page's policy allows it
    still : the picture without WebGL, sound : what leads the clock, if any, as data addresses
    sentences : what is told below the picture
    """

    description: Markup
    data: Markup
    script: Markup
    digest: str
    still: str
    sound: str
    sentences: tuple[str, ...]


@cache
def script() -> str:
    """Return the bundle, so that nothing in it ends the element that it stands in."""
    text = SCRIPT.read_text(encoding="utf-8").replace("</script", "<\\/script")
    return text.replace("<!--", "<\\!--")


@cache
def digest() -> str:
    """Return the word by which a page's policy allows the viewer."""
    return page.digest(script())


def data_address(content: bytes, kind: str) -> str:
    """Return a file as an address that holds it; `kind` is its media type."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _sentences(scene: Scene, motion: Motion, several: bool) -> tuple[str, ...]:
    told = [
        f"Every drawn point is within {scene.error_mm:.2f} mm of the simulated one: frames are"
        " stored in 16 bits, soft parts as principal components."
    ]
    if scene.rate < float("inf"):
        every = len(motion.time) / max(float(motion.time[-1] - motion.time[0]), 1e-9)
        fewer = " (fewer than the file)" if scene.rate < 0.9 * every else ""
        told.append(f"{scene.rate:.0f} frames a second are stored{fewer}, straight between them.")
    if several:
        told.append("A run that is shorter stands still after its end.")
    told.append(skin_sentence(motion))
    return tuple(told)


def skin_sentence(motion: Motion) -> str:
    """Say what the skin is."""
    if motion.skin is None:
        return "The skin is the outside of the simulated torso: this file has no human skin."
    about = motion.skin.about
    if about.get("made_from") == "human":
        size = motion.skin.rest.subject
        who = "woman" if size.sex == "female" else "man"
        return (
            f"The skin is that of a {who} of {size.stature:.2f} m, {size.mass:.0f} kg and"
            f" {float(about['age_years']):.0f} years, bound to bones and belly; no force acts"
            " on it."
        )
    return "The skin is a mesh of one's own, bound to bones and belly; no force acts on it."


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
    steps: Sequence[Mapping[str, Any]] = (),
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
    steps : name, inspiration and period (s) of each trajectory, if one at a time is to be chosen
    """
    first = next(iter(motions.values()))
    scene = build_scene(motions, place=place, facts=facts, loop=loop, span=span, steps=steps)
    return Viewer(
        description=Markup(scene.description),
        data=Markup(scene.data),
        script=Markup(script()),
        digest=digest(),
        still=data_address(still_png(first, _fullest(first)), "image/png"),
        sound=sound,
        sentences=_sentences(scene, first, len(motions) > 1 and not steps),
    )


def _heading(about: Mapping[str, Any], path: Path) -> str:
    return str(about.get("style") or about.get("recording") or path.stem)


def _names(headings: Sequence[str], paths: Sequence[Path]) -> list[str]:
    """A name of its own for each run: its style, else its file, else a number with it."""
    for found in (list(headings), [path.stem for path in paths]):
        if len(set(found)) == len(found):
            return found
    return [f"{heading} {k + 1}" for k, heading in enumerate(headings)]


def _sizes(motion: Motion) -> str:
    lung = motion.volumes["lung"]
    return f"{1e3 * float(np.ptp(lung)):.2f} L"


def _head(
    motions: Mapping[str, Motion], abouts: Sequence[Mapping[str, Any]], paths: Sequence[Path]
) -> Headline:
    numbers = [(_sizes(m), f"least to largest lung volume, {name}") for name, m in motions.items()]
    seconds = [f"{float(np.ptp(motion.time)):.1f} s" for motion in motions.values()]
    about = abouts[0]
    who = [str(about[key]) for key in ("subject", "posture") if about.get(key)]
    several = len(motions) > 1
    words = "Side by side, on one clock: each begins with its first frame"
    return Headline(
        kind="Runs side by side" if several else "Run",
        title=" and ".join(motions),
        subtitle=words if several else ", ".join(who),
        result=f"{', '.join(seconds)} of the torso’s motion.",
        numbers=tuple(numbers),
        made=written(paths),
    )


def write_view(trajectories: Sequence[Path], out: Path) -> Path:
    """Write a page that plays a trajectory, or several side by side.

    Parameters
    ----------
    trajectories : HDF5 files of `pleura simulate` or of a fit
    out : the page

    Raises
    ------
    InputError
        if a file is no trajectory, or they are too long or too many for a page
    """
    if len(trajectories) > MOST_BESIDE:
        raise InputError(
            f"view: {len(trajectories)} runs are too many side by side. Name at most {MOST_BESIDE}."
        )
    loaded = [load_motion(path) for path in trajectories]
    abouts = [about for _, about in loaded]
    headings = [
        _heading(about, path) for (_, about), path in zip(loaded, trajectories, strict=True)
    ]
    names = _names(headings, trajectories)
    motions = {name: motion for name, (motion, _) in zip(names, loaded, strict=True)}
    place = ", ".join(map(str, trajectories))
    columns = list(dict.fromkeys(key for about in abouts for key in about))
    text = page.render(
        "view.html",
        head=_head(motions, abouts, trajectories),
        viewer=make_viewer(motions, place=place),
        about_columns=["run", *map(page.words, columns)],
        about=[
            (name, *(about.get(c, "") for c in columns))
            for name, about in zip(names, abouts, strict=True)
        ],
        citations=citations("view"),
    )
    check_size(text, place, "Simulate a shorter time.")
    write_text(out, text)
    return out


def check_size(text: str, place: str, remedy: str) -> None:
    """Refuse a page that is too large to be opened at ease."""
    if len(text) > MOST_BYTES:
        raise InputError(
            f"{place}: the page would have {len(text) / 1e6:.0f} MB, more than"
            f" {MOST_BYTES / 1e6:.0f}. {remedy}"
        )
