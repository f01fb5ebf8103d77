"""MP4: H.264 pictures, AAC sound."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray

from pipeline.render.sound import RATE
from pipeline.render.stage import Picture

Floats = NDArray[np.float32]

CODEC = "libx264"
QUALITY = "17"
"""Constant rate factor; 17 can hardly be told from the picture itself."""
SOUND_BITS = 192_000
BT709 = 1
"""Primaries and transfer in the numbers of ITU-T H.273."""


def can_encode() -> bool:
    """Whether the installed library has the coder."""
    return CODEC in av.codecs_available


def write_film(
    path: Path,
    pictures: Iterable[Picture],
    *,
    size: tuple[int, int],
    fps: float,
    sound: Floats | None = None,
) -> None:
    """Write pictures (height, width, 4) as they come, and a sound.

    Parameters
    ----------
    sound : (n, n_channels) at 48 kHz, full scale = 1
    """
    options = {"movflags": "+faststart"}
    with av.open(str(path), "w", format="mp4", options=options) as out:
        video = _video(out, size, fps)
        audio: Any = None
        if sound is not None:
            layout = "mono" if sound.shape[1] == 1 else "stereo"
            audio = out.add_stream("aac", rate=RATE, layout=layout)
            audio.bit_rate = SOUND_BITS
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture[..., :3]), "rgb24")
            coded = frame.reformat(
                format="yuv420p",
                src_colorspace=Colorspace.ITU709,
                dst_colorspace=Colorspace.ITU709,
                dst_color_range=ColorRange.MPEG,
            )
            out.mux(video.encode(coded))
        out.mux(video.encode(None))
        if audio is not None and sound is not None:
            _add_sound(out, audio, sound)


def _video(out: Any, size: tuple[int, int], fps: float) -> Any:
    video = out.add_stream(CODEC, rate=Fraction(fps).limit_denominator(1001))
    video.width, video.height = size
    video.pix_fmt = "yuv420p"
    video.options = {"crf": QUALITY, "preset": "medium", "threads": "2"}
    context = video.codec_context
    context.color_primaries = context.color_trc = BT709
    context.colorspace, context.color_range = Colorspace.ITU709, ColorRange.MPEG
    return video


def _add_sound(out: Any, audio: Any, sound: Floats) -> None:
    layout = "mono" if sound.shape[1] == 1 else "stereo"
    frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(sound.T), "fltp", layout)
    frame.sample_rate, frame.pts = RATE, 0
    frame.time_base = Fraction(1, RATE)
    out.mux(audio.encode(frame))
    out.mux(audio.encode(None))
