"""Look at the bytes of a C3D file first: the library's own complaints help nobody."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import NamedTuple

from sim.errors import InputError

BLOCK = 512
C3D_KEY = 0x50
INTEL, DEC, MIPS = 84, 85, 86


class Header(NamedTuple):
    """What the first block of a C3D file states."""

    n_points: int
    n_analog_per_frame: int
    first_frame: int
    last_frame: int
    scale: float
    data_block: int
    rate: float


def _dec_float(raw: bytes) -> float:
    # DEC floats swap their 16-bit halves and have an exponent that is 2 larger
    return float(struct.unpack("<f", raw[2:4] + raw[0:2])[0]) / 4.0


def read_header(path: Path) -> Header:
    """Check that `path` is a whole C3D file and return its header."""
    if not path.is_file():
        raise InputError(f"{path}: file: not found. Check the path in the recordings table.")
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path}: file: empty. Export the recording again.")
    with path.open("rb") as file:
        block = file.read(BLOCK)
        if len(block) < BLOCK or block[1] != C3D_KEY or block[0] < 2:
            raise InputError(
                f"{path}: header: not a C3D file. Give a real C3D file, or name a text table"
                " .csv or .tsv."
            )
        file.seek((block[0] - 1) * BLOCK)
        parameters = file.read(4)
    if len(parameters) < 4:
        raise InputError(f"{path}: parameters: the file is cut off. Export it again.")
    header = _unpack(path, block, parameters[3])
    _check_length(path, header, size)
    _check_parameters(path, (block[0] - 1) * BLOCK, ">" if parameters[3] == MIPS else "<")
    return header


def _check_parameters(path: Path, start: int, order: str) -> None:
    """Walk the chain of groups and parameters: the library follows damaged links to its death."""
    content = path.read_bytes()
    end = min(len(content), start + content[start + 2] * BLOCK)
    at, names = start + 4, set()
    damaged = InputError(f"{path}: parameters: damaged. Copy or export the file again.")
    while at + 2 <= end and content[at] != 0:
        n_name, identity = abs(struct.unpack("b", content[at : at + 1])[0]), content[at + 1]
        link = at + 2 + n_name
        if link + 2 > end or identity == 0:
            raise damaged
        name = content[at + 2 : link]
        if not all(33 <= letter < 127 for letter in name):
            raise damaged
        names.add((identity, name.upper()))
        (step,) = struct.unpack(order + "H", content[link : link + 2])
        if identity < 128 and not _fits(content, link + 2, end if step == 0 else link + step):
            raise damaged
        if step == 0:
            break
        at = link + step
        if at > end:
            raise damaged
    if not any(name == b"POINT" and identity >= 128 for identity, name in names):
        raise damaged


def _fits(content: bytes, at: int, end: int) -> bool:
    """Whether a parameter's dimensions and values end where the next record starts."""
    if at + 2 > end:
        return False
    size, n_dimensions = abs(struct.unpack("b", content[at : at + 1])[0]), content[at + 1]
    if size not in (1, 2, 4) or n_dimensions > 7 or at + 2 + n_dimensions > end:
        return False
    n_values = math.prod(content[at + 2 : at + 2 + n_dimensions])
    return bool(at + 2 + n_dimensions + size * n_values <= end)


def _unpack(path: Path, block: bytes, processor: int) -> Header:
    if processor not in (INTEL, DEC, MIPS):
        raise InputError(
            f"{path}: header: processor type {processor} is unknown. Export the file again."
        )
    order = ">" if processor == MIPS else "<"
    n_points, n_analog, first, last = struct.unpack(order + "4H", block[2:10])
    (data_block,) = struct.unpack(order + "H", block[16:18])
    if processor == DEC:
        scale, rate = _dec_float(block[12:16]), _dec_float(block[20:24])
    else:
        (scale,) = struct.unpack(order + "f", block[12:16])
        (rate,) = struct.unpack(order + "f", block[20:24])
    return Header(n_points, n_analog, first, last, scale, data_block, rate)


def _check_length(path: Path, header: Header, size: int) -> None:
    if header.n_points == 0:
        raise InputError(f"{path}: header: holds no markers. Export the markers too.")
    n_frames = header.last_frame - header.first_frame + 1
    width = 4 if header.scale < 0 else 2
    frame = width * (4 * header.n_points + header.n_analog_per_frame)
    # 65535 is where long files overflow the header's counter: the parameters know better
    if header.last_frame >= 65535 or n_frames < 1:
        return
    needed = (header.data_block - 1) * BLOCK + n_frames * frame
    if size < needed:
        have = max(0, (size - (header.data_block - 1) * BLOCK) // frame)
        raise InputError(
            f"{path}: data: the file is cut off after {have} of {n_frames} frames."
            " Copy or export it again."
        )
