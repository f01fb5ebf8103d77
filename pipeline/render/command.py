"""Words of `pleura render`, and whether what it needs is installed."""

from __future__ import annotations

import argparse
from pathlib import Path

from pipeline.extras import need

MODULES = ("moderngl", "av", "PIL")


def add_words(parser: argparse.ArgumentParser) -> None:
    """Add what can be asked for."""
    parser.add_argument("trajectory", type=Path, metavar="TRAJECTORY.h5")
    parser.add_argument(
        "--to", type=Path, required=True, metavar="FILM.mp4|STRIP.png|FOLDER",
        help="a film; pictures side by side; or, without ending, a folder of numbered pictures",
    )  # fmt: skip
    parser.add_argument(
        "--preset", help="outside, skeleton (if nothing is said), muscles, diaphragm"
    )
    parser.add_argument("--layers", metavar="bone,skin=0.3,...", help="each with its opacity")
    parser.add_argument("--view", default="three-quarter", help="front, side, back, above")
    parser.add_argument("--size", metavar="1280x720", help="of a picture, pixels")
    parser.add_argument("--background", metavar="COLOUR", help="'#rrggbb' or transparent")
    parser.add_argument("--from-s", type=float, metavar="S", help="first moment")
    parser.add_argument("--until-s", type=float, metavar="S", help="last moment")
    parser.add_argument("--fps", type=float, default=30.0, help="pictures a second (30)")
    parser.add_argument("--pictures", type=int, metavar="N", help="in a strip (6)")
    parser.add_argument("--times-s", metavar="0,0.5,1", help="their moments, instead")
    parser.add_argument("--sound", type=Path, metavar="SOUND.wav", help="of the film")
    parser.add_argument(
        "--sound-start-s", type=float, metavar="S",
        help="when the sound begins in the run; else as the laugh's record beside the run has it",
    )  # fmt: skip


def run(options: argparse.Namespace) -> str:
    """Draw what is asked for; return one line about it."""
    need(MODULES, extra="render", out=options.to)
    from pipeline.render.order import Words
    from pipeline.render.write import render

    words = Words(
        to=options.to, preset=options.preset, layers=options.layers, view=options.view,
        size=options.size, background=options.background, start=options.from_s,
        stop=options.until_s, fps=options.fps, pictures=options.pictures, times=options.times_s,
        sound=options.sound, sound_start=options.sound_start_s,
    )  # fmt: skip
    return render(options.trajectory, words)
