"""Sound and torso of a laugh's page on one clock, in the time of the sound's file."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import soundfile
from numpy.typing import NDArray
from scipy import signal

from pipeline import status
from pipeline.audio import Sound
from pipeline.records import load
from pipeline.view import Viewer, data_address, make_viewer
from sim.errors import InputError
from sim.motion import Motion
from sim.trajectory import load_motion

Floats = NDArray[np.float64]
Span = tuple[float, float]
RATES = (16000, 12000, 8000, 6000)
"""Hz that a page's sound may have; the first with which it is small enough is taken."""
MOST_SOUND = 2_500_000
"""Characters of a sound in a page that shows a torso too; without loss, as a codec with loss
would begin later than its recording."""
LOUDEST = 0.9
FACTS = (
    "From rest, with the sound; before its control file begins and after it ends it is still.",
)


@dataclass(frozen=True, kw_only=True, slots=True)
class Heard:
    """What a page plays.

    Parameters
    ----------
    address : of the sound; empty without one
    span : s in the file, of the clock
    sentence : what was done to the sound
    viewer : of the torso, or none; why : there is none
    """

    address: str
    span: Span
    sentence: str
    viewer: Viewer | None
    why: str


def padded(sound: Sound, span: Span) -> Floats:
    """Samples over a span of the file's time, silent where the sound is not.

    Parameters
    ----------
    span : s, about the sound

    Returns
    -------
    (n,), loudest 0.9
    """
    out = np.zeros(round((span[1] - span[0]) * sound.rate))
    first = round((sound.start - span[0]) * sound.rate)
    samples = np.asarray(sound.samples, dtype=float)[: len(out) - first]
    loudest = max(float(np.abs(samples).max(initial=0.0)), 1e-9)
    out[first : first + len(samples)] = LOUDEST * samples / loudest
    return out


def encoded(samples: Floats, rate: float, most: int) -> tuple[str, int]:
    """Address of a sound as FLAC and its rate, the highest that takes at most `most` characters."""
    address, used = "", int(rate)
    for used in [int(rate), *(r for r in RATES if r < rate)]:
        heard = samples if used == rate else signal.resample_poly(samples, used, int(rate))
        stream = io.BytesIO()
        soundfile.write(stream, np.clip(heard, -1.0, 1.0), used, format="FLAC", subtype="PCM_16")
        address = data_address(stream.getvalue(), "audio/flac")
        if len(address) <= most:
            break
    return address, used


def _motion(folder: Path, follow: Mapping[str, Any]) -> Motion | None:
    """The torso that follows, in the time of the sound's file."""
    path = folder / "trajectory.h5"
    if follow["status"] != status.OK or not path.exists():
        return None
    motion, _ = load_motion(path)
    return replace(motion, time=motion.time + float(follow["control_starts_at_s"]))


def heard(folder: Path, follow: Mapping[str, Any]) -> Heard:
    """Put together what a page plays.

    Parameters
    ----------
    folder : results of the recording
    follow : record of the stage
    """
    path = folder / "audio.npz"
    if not path.exists():
        return Heard(address="", span=(0.0, 0.0), sentence="", viewer=None, why="")
    sound, motion = load(Sound, path), _motion(folder, follow)
    span = (sound.start, sound.start + sound.duration)
    if motion is not None:
        span = min(span[0], float(motion.time[0])), max(span[1], float(motion.time[-1]))
    address, rate = encoded(padded(sound, span), sound.rate, MOST_SOUND)
    fewer = f", {rate} Hz of {sound.rate:.0f} to keep the page small" if rate < sound.rate else ""
    viewer, why = None, ""
    if motion is not None:
        try:
            viewer = make_viewer(
                {folder.name: motion}, place=str(path.with_name("trajectory.h5")), facts=FACTS,
                loop=False, span=span,
            )  # fmt: skip
        except InputError as error:
            why = str(error)
    said = f"The sound is made louder, its loudest sample {LOUDEST} of full scale{fewer}."
    return Heard(address=address, span=span, sentence=said, viewer=viewer, why=why)
