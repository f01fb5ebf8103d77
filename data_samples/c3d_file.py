"""Write markers as C3D in millimetres: floats as ezc3d does, or 16-bit integers, half the size."""

from __future__ import annotations

import struct
from pathlib import Path

import ezc3d
import numpy as np
from numpy.typing import NDArray

from data_samples.trunk import Floats

BLOCK = 512
MM_PER_M = 1e3


def write_c3d(
    path: Path,
    *,
    labels: tuple[str, ...],
    positions: Floats,
    residuals: Floats,
    rate: float,
    step: float | None,
) -> None:
    """Write one recording.

    Parameters
    ----------
    positions : (n_frames, n_markers, 3), m; zero or NaN where a marker was lost
    residuals : (n_frames, n_markers), mm; negative = not measured
    rate : Hz
    step : m, resolution of integer storage; None stores floats
    """
    content = ezc3d.c3d()
    point = content["parameters"]["POINT"]
    point["RATE"]["value"] = [rate]
    point["LABELS"]["value"] = list(labels)
    point["UNITS"]["value"] = ["mm"]
    if step is not None:
        point["SCALE"]["value"] = [step * MM_PER_M]
    n_frames, n_markers = residuals.shape
    homogeneous = np.ones((4, n_markers, n_frames))
    homogeneous[:3] = positions.transpose(2, 1, 0) * MM_PER_M
    content["data"]["points"] = homogeneous
    content["data"]["meta_points"]["residuals"] = residuals.T[None]
    content["data"]["meta_points"]["camera_masks"] = np.zeros((7, n_markers, n_frames), dtype=bool)
    content.write(str(path))
    if step is not None:
        _to_integers(path, step * MM_PER_M, homogeneous[:3], residuals.T)


def _to_integers(path: Path, scale: float, points: Floats, residuals: NDArray[np.float64]) -> None:
    """Replace the float data that ezc3d wrote by the integer form of the C3D standard."""
    content = path.read_bytes()
    data_block = struct.unpack_from("<H", content, 16)[0]
    head = bytearray(content[: BLOCK * (data_block - 1)])
    struct.pack_into("<f", head, 12, scale)
    negative = struct.pack("<f", -scale)
    if bytes(head).count(negative) != 1:
        raise ValueError(f"{path}: POINT:SCALE is not found once. Check the ezc3d version.")
    place = head.index(negative)
    head[place : place + 4] = struct.pack("<f", scale)
    words = np.zeros((points.shape[2], points.shape[1], 4), dtype="<i2")
    words[:, :, :3] = np.rint(points.transpose(2, 1, 0) / scale)
    words[:, :, 3] = np.where(residuals.T < 0.0, -1, 0)
    body = words.tobytes()
    path.write_bytes(bytes(head) + body + bytes(-len(body) % BLOCK))
