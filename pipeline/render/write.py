"""`pleura render`: a run as a film, a filmstrip, or numbered pictures."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from pipeline.records import write_bytes
from pipeline.render import film, order, pictures, sound
from pipeline.render.camera import Camera, look
from pipeline.render.order import Words
from pipeline.render.parts import Part, parts
from pipeline.render.pose import Poses
from pipeline.render.stage import Picture, Stage
from sim.errors import InputError
from sim.motion import Motion, skinned
from sim.trajectory import load_motion
from sim.writing import whole_file

FRAMED = 25
"""Moments at which the camera looks whether everything is in the picture."""


class _Scene:
    """A run that is ready to be drawn."""

    def __init__(
        self, motion: Motion, words: Words, size: tuple[int, int], *, film: bool, foot: float = 0.0
    ) -> None:
        opacity = order.chosen_opacity(words, motion)
        background = order.chosen_background(words, film=film)
        view = order.chosen_view(words)
        self.poses = Poses(motion)
        self.parts = parts(motion, opacity)
        if not self.parts:
            raise InputError(f"{words.to}: the run has nothing of what is to be shown.")
        self.camera = _camera(self.poses, self.parts, motion, view, size, foot)
        self.stage = Stage(self.parts, self.poses.at(float(motion.time[0])), size, background)

    def draw(self, times: Sequence[float]) -> Iterator[Picture]:
        """Pictures of the moments at times (s), one after the other."""
        try:
            for time in times:
                yield self.stage.draw(self.poses.at(time), self.camera)
        finally:
            self.stage.close()

    def told(self, motion: Motion) -> str:
        """The scale of what is coloured, if it is."""
        muscles = any(part.layer == "muscles" for part in self.parts)
        if not muscles or motion.elements is None:
            return ""
        return f", the brightest muscle {float(motion.elements.tension.max()):.0f} N"


def _camera(
    poses: Poses,
    drawn: Sequence[Part],
    motion: Motion,
    view: str,
    size: tuple[int, int],
    foot: float,
) -> Camera:
    """One camera for the whole run, so that what does not move stays in its place."""
    some = np.linspace(0, len(motion.time) - 1, min(FRAMED, len(motion.time))).astype(int)
    moments = [poses.at(float(motion.time[k])) for k in some]
    points = np.concatenate([part.source.at(m).places for m in moments for part in drawn])
    return look(view, points[np.isfinite(points).all(axis=1)], size[0] / size[1], foot)


def _film(trajectory: Path, motion: Motion, words: Words) -> str:
    order.refuse(words, ("pictures", "times"), "a film")
    if not film.can_encode():
        raise InputError(f"{words.to}: the installed PyAV has no H.264 coder. Install its wheel.")
    size, fps = order.chosen_size(words, film=True), order.chosen_fps(words)
    track, span = None, (float(motion.time[0]), float(motion.time[-1]))
    if words.sound is not None:
        begins = sound.followed_start(trajectory)
        track = sound.read_track(
            words.sound, begins if words.sound_start is None else words.sound_start
        )
        span = min(span[0], track.start), max(span[1], track.stop)
    elif words.sound_start is not None:
        raise InputError(f"{words.to}: --sound-start-s without --sound. Name the sound too.")
    start, stop = order.chosen_span(words, span)
    n = max(round((stop - start) * fps), 1)
    scene = _Scene(motion, words, size, film=True)
    heard = None if track is None else track.cut(start, start + n / fps)
    times = [start + k / fps for k in range(n)]
    with whole_file(words.to) as temporary:
        film.write_film(temporary, scene.draw(times), size=size, fps=fps, sound=heard)
    spoken = "" if heard is None else ", with sound"
    return f"{n} pictures of {size[0]}x{size[1]}, {n / fps:.2f} s{spoken}{scene.told(motion)}"


def _span(motion: Motion, words: Words) -> tuple[float, float]:
    """What is shown of a run; a run of one frame is one moment."""
    first, last = float(motion.time[0]), float(motion.time[-1])
    if first == last and words.start is None and words.stop is None:
        return first, last
    return order.chosen_span(words, (first, last))


def _strip(trajectory: Path, motion: Motion, words: Words) -> str:
    order.refuse(words, ("sound", "sound_start"), "a picture")
    size = order.chosen_size(words, film=False)
    times = order.chosen_times(words, _span(motion, words))
    foot = pictures.FOOT if len(times) > 1 else 0.0
    scene = _Scene(motion, words, size, film=False, foot=foot)
    drawn = list(scene.draw(times))
    captions = [f"{time:.2f} s" for time in times] if len(times) > 1 else []
    strip = pictures.filmstrip(drawn, captions, words.background or "")
    write_bytes(words.to, pictures.png(strip))
    many = f"{len(times)} pictures" if len(times) > 1 else "a picture"
    return f"{many} of {size[0]}x{size[1]}{scene.told(motion)}"


def _folder(trajectory: Path, motion: Motion, words: Words) -> str:
    order.refuse(words, ("sound", "sound_start", "pictures", "times"), "numbered pictures")
    if words.to.exists():
        raise InputError(f"{words.to}: is there already. Name a folder that is not.")
    size, fps = order.chosen_size(words, film=True), order.chosen_fps(words)
    start, stop = order.chosen_span(words, (float(motion.time[0]), float(motion.time[-1])))
    n = max(round((stop - start) * fps), 1)
    scene = _Scene(motion, words, size, film=False)
    words.to.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=words.to.parent, prefix=f".{words.to.name}.") as made:
        inner = Path(made) / words.to.name
        inner.mkdir()
        for k, picture in enumerate(scene.draw([start + k / fps for k in range(n)])):
            (inner / f"{k:05d}.png").write_bytes(pictures.png(picture))
        inner.rename(words.to)
    return f"{n} pictures of {size[0]}x{size[1]}, {fps:g} a second{scene.told(motion)}"


Writer = Callable[[Path, Motion, Words], str]
WRITERS: dict[str, Writer] = {".mp4": _film, ".png": _strip, "": _folder}


def render(trajectory: Path, words: Words) -> str:
    """Draw a trajectory as the ending of `words.to` asks; return one line about it.

    Raises
    ------
    InputError
        for words that mean nothing, where there is no GL library, or a place that cannot be written
    """
    write = WRITERS.get(words.to.suffix.lower())
    if write is None:
        raise InputError(
            f"{words.to}: unknown ending. Use .mp4, .png, or none for a folder of pictures."
        )
    motion = skinned(load_motion(trajectory)[0])
    try:
        return f"{words.to}: {write(trajectory, motion, words)}"
    except OSError as error:
        raise InputError(
            f"{words.to}: cannot be written ({error}). Choose another place."
        ) from error
