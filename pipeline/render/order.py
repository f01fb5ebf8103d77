"""What is asked for: words of the command line, checked against the run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pipeline.render.camera import VIEWS
from pipeline.scene import layers
from sim.errors import InputError
from sim.motion import Motion

FIRST_PRESET = "skeleton"
"""As in the page."""
FILM_SIZE, PICTURE_SIZE = (1280, 720), (420, 720)
LEAST_SIZE, MOST_SIZE = 64, 4096
MOST_FPS = 240.0
MOST_PICTURES = 60
TRANSPARENT = "transparent"


@dataclass(frozen=True, kw_only=True, slots=True)
class Words:
    """As they were given; none where nothing was said.

    Parameters
    ----------
    to : the file or folder to write
    start, stop : s, of the run's own time; fps : Hz
    pictures : how many stand in a filmstrip; times : s, comma between
    sound_start : s, of the run's own time, at which the sound's file begins
    """

    to: Path
    preset: str | None = None
    layers: str | None = None
    view: str = "three-quarter"
    size: str | None = None
    background: str | None = None
    start: float | None = None
    stop: float | None = None
    fps: float = 30.0
    pictures: int | None = None
    times: str | None = None
    sound: Path | None = None
    sound_start: float | None = None


def chosen_opacity(words: Words, motion: Motion) -> dict[str, float]:
    """Opacity of each layer, from `--layers` or a preset.

    Raises
    ------
    InputError
        for a name that there is not, and a layer that the run does not have
    """
    rows = layers()
    if words.layers is not None:
        if words.preset is not None:
            raise InputError(
                f"{words.to}: --layers and --preset both say what is shown. Give one of them."
            )
        return _named_layers(words.layers, _present(motion, rows))
    presets = list(rows[0]["presets"])
    asked = words.preset or FIRST_PRESET
    found = [name for name in presets if name == asked or name.startswith(f"{asked} ")]
    if not found:
        raise InputError(f"--preset {asked}: there is none. Use one of {', '.join(presets)}.")
    return {row["layer"]: row["presets"][found[0]] for row in rows}


def _present(motion: Motion, rows: list[dict[str, object]]) -> dict[str, bool]:
    tissues = {str(shape.tissue) for shape in motion.shapes.values()}
    has = {*motion.soft, *tissues}
    if motion.elements is not None:
        has.add("muscles")
    if motion.marker_names:
        has.add("markers")
    return {str(row["layer"]): row["layer"] in has for row in rows}


def _named_layers(text: str, present: Mapping[str, bool]) -> dict[str, float]:
    out = {}
    there = [name for name, here in present.items() if here]
    for word in filter(None, (part.strip() for part in text.split(","))):
        name, _, much = word.partition("=")
        if name not in present:
            raise InputError(f"--layers {name}: there is none. Use {', '.join(there)}.")
        if not present[name]:
            raise InputError(f"--layers {name}: the run has none. It has {', '.join(there)}.")
        if much and not re.fullmatch(r"0|1|0?\.\d+|1\.0+", much):
            raise InputError(f"--layers {word}: opacity is from 0 to 1, as {name}=0.3.")
        out[name] = float(much or 1.0)
    if not any(out.values()):
        raise InputError(f"--layers {text}: nothing is shown. Use {', '.join(there)}.")
    return out


def chosen_view(words: Words) -> str:
    """The side it is seen from."""
    if words.view not in VIEWS:
        raise InputError(f"--view {words.view}: there is none. Use one of {', '.join(VIEWS)}.")
    return words.view


def chosen_size(words: Words, *, film: bool) -> tuple[int, int]:
    """Width and height of a picture, pixels; a film's are even, as its coding asks."""
    if words.size is None:
        return FILM_SIZE if film else PICTURE_SIZE
    found = re.fullmatch(r"(\d{1,5})[xX×](\d{1,5})", words.size)
    width, height = (int(found[1]), int(found[2])) if found else (0, 0)
    if not LEAST_SIZE <= min(width, height) <= max(width, height) <= MOST_SIZE:
        raise InputError(
            f"--size {words.size}: is not a size. Give width and height from {LEAST_SIZE} to"
            f" {MOST_SIZE} pixels, as 1280x720."
        )
    if film and (width % 2 or height % 2):
        even = f"{width + width % 2}x{height + height % 2}"
        raise InputError(f"--size {words.size}: a film's sizes are even. Use {even}.")
    return width, height


def chosen_background(words: Words, *, film: bool) -> str:
    """`#rrggbb`, "transparent", or empty for the soft one."""
    asked = words.background or ""
    if asked == TRANSPARENT and film:
        raise InputError(
            f"{words.to}: a film of this kind has no transparency. Name a folder, for numbered"
            " pictures, or another --background."
        )
    if asked not in ("", TRANSPARENT) and not re.fullmatch(r"#[0-9a-fA-F]{6}", asked):
        raise InputError(f"--background {asked}: use a colour as '#ffffff', or {TRANSPARENT}.")
    return asked


def chosen_span(words: Words, whole: tuple[float, float]) -> tuple[float, float]:
    """First and last moment, s, of the run's own time.

    Parameters
    ----------
    whole : s, what there is to show and to hear
    """
    start = whole[0] if words.start is None else words.start
    stop = whole[1] if words.stop is None else words.stop
    there = f"There is {whole[0]:.2f} to {whole[1]:.2f} s"
    if not whole[0] - 5e-3 <= start <= whole[1] or not stop <= whole[1] + 5e-3:
        raise InputError(f"{words.to}: {start:g} to {stop:g} s is not in the run. {there}.")
    if stop <= start:
        raise InputError(f"{words.to}: {start:g} to {stop:g} s is no time. {there}.")
    return start, stop


def chosen_fps(words: Words) -> float:
    """Pictures a second."""
    if not 1.0 <= words.fps <= MOST_FPS:
        raise InputError(f"--fps {words.fps:g}: use 1 to {MOST_FPS:g} pictures a second.")
    return words.fps


def chosen_times(words: Words, span: tuple[float, float]) -> list[float]:
    """Moments of a filmstrip, s: those that are named, else evenly spread with both ends."""
    if words.times is None:
        n = 6 if words.pictures is None else words.pictures
        if not 1 <= n <= MOST_PICTURES:
            raise InputError(f"--pictures {n}: use 1 to {MOST_PICTURES}.")
        gap = (span[1] - span[0]) / max(n - 1, 1)
        return [span[0] + k * gap for k in range(n)]
    try:
        times = [float(word) for word in words.times.split(",")]
    except ValueError:
        raise InputError(f"--times-s {words.times}: use seconds as 0,0.5,1.") from None
    outside = [t for t in times if not span[0] - 5e-3 <= t <= span[1] + 5e-3]
    if outside or len(times) > MOST_PICTURES:
        what = f"{outside[0]:g} s is not in the run" if outside else "too many"
        raise InputError(
            f"--times-s {words.times}: {what}. Name at most {MOST_PICTURES} moments from"
            f" {span[0]:.2f} to {span[1]:.2f} s."
        )
    return times


def refuse(words: Words, names: tuple[str, ...], kind: str) -> None:
    """Refuse words that mean nothing for what is written."""
    flags = {"pictures": "--pictures", "times": "--times-s", "sound": "--sound"}
    flags["sound_start"] = "--sound-start-s"
    for name in names:
        if getattr(words, name) is not None:
            raise InputError(f"{words.to}: {flags[name]} means nothing for {kind}. Leave it out.")
