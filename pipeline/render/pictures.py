"""PNG: a filmstrip, or one picture a file."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from pipeline.look import srgb
from pipeline.render.stage import Picture

FONT = Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
LETTERS = 1 / 32
"""Height of the letters over that of the picture."""
FOOT = 2.4 * LETTERS
"""Of a picture's height that its words take."""
DARK, LIGHT = (45, 52, 57), (235, 238, 240)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def png(picture: Picture) -> bytes:
    """A picture (height, width, 4) as PNG; without its fourth channel if it hides everything."""
    solid = bool((picture[..., 3] == 255).all())
    stream = io.BytesIO()
    Image.fromarray(picture[..., :3] if solid else picture).save(stream, format="PNG")
    return stream.getvalue()


def filmstrip(pictures: Sequence[Picture], captions: Sequence[str], background: str) -> Picture:
    """Pictures side by side, each with a line of words at its foot.

    Parameters
    ----------
    background : of the pictures, as it was asked for; the words are dark or light by it
    """
    made = Image.fromarray(np.hstack(pictures))
    high, wide = pictures[0].shape[:2]
    letters = max(round(LETTERS * high), 9)
    font = ImageFont.truetype(str(FONT), letters)
    dark = not background.startswith("#") or float(srgb(background) @ LUMINANCE) > 0.4
    draw = ImageDraw.Draw(made)
    for k, words in enumerate(captions):
        place = (wide * (k + 0.5), high - 0.8 * letters)
        draw.text(place, words, font=font, anchor="ms", fill=(*(DARK if dark else LIGHT), 255))
    return np.asarray(made)
