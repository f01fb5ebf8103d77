"""Numbers made small for a web page: whole numbers of 8 or 16 bits, deflated, as text.

Frames are stored as differences from the frame before, which deflate well. What is read back in the
page is computed here too, so that the error of packing is known and can be stated.
"""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LARGEST = 32767
"""Of 16 bits with a sign."""
MOST_MODES = 256
"""More principal components than this would be larger than the frames themselves."""


class Packer:
    """Collects arrays; `text` is all of them, and each `add` tells where its array lies."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, values: NDArray[Any], *, differences: bool = False) -> dict[str, Any]:
        """Add whole numbers; `differences` stores rows after the first as steps.

        Returns
        -------
        offset in bytes, type, shape, and whether rows are steps
        """
        if differences:
            values = np.diff(values, axis=0, prepend=np.zeros_like(values[:1]))
        pad = -self._size % 4
        data = np.ascontiguousarray(values).tobytes()
        place = {"at": self._size + pad, "type": values.dtype.name, "shape": list(values.shape)}
        self._parts += [bytes(pad), data]
        self._size += pad + len(data)
        return place | ({"steps": True} if differences else {})

    def text(self) -> str:
        """Everything, deflated, in base 64."""
        return base64.b64encode(zlib.compress(b"".join(self._parts), 9)).decode("ascii")


@dataclass(frozen=True, kw_only=True, slots=True)
class Quantised:
    """Numbers as `low + scale * whole`; `low` and `scale` are one for each last axis."""

    whole: NDArray[np.int16]
    low: Floats
    scale: Floats

    def values(self) -> Floats:
        """Return the numbers that the page sees."""
        return np.asarray(self.low + self.scale * self.whole)

    def put(self, packer: Packer, *, differences: bool = False) -> dict[str, Any]:
        """Add to a packer; return the place with `low` and `scale`."""
        place = packer.add(self.whole, differences=differences)
        return place | {"low": self.low.tolist(), "scale": self.scale.tolist()}


def quantise(values: Floats) -> Quantised:
    """16 bits over the range of each component along the last axis."""
    flat = values.reshape(-1, values.shape[-1])
    least, most = flat.min(axis=0), flat.max(axis=0)
    low, scale = 0.5 * (least + most), np.maximum(most - least, 1e-12) / (2 * LARGEST)
    return Quantised(whole=np.round((values - low) / scale).astype(np.int16), low=low, scale=scale)


@dataclass(frozen=True, kw_only=True, slots=True)
class Modes:
    """Moving points as a mean and principal components.

    Parameters
    ----------
    mean : (n, 3); shapes : (n_modes, 3 n) as rows of `scale`; weights : (n_frames, n_modes)
    error : m, largest distance of any point in any frame from where it should be
    """

    mean: Quantised
    shapes: NDArray[np.int16]
    scale: Floats
    weights: Quantised
    error: float

    def put(self, packer: Packer) -> dict[str, Any]:
        """Add to a packer; return the places."""
        return {
            "mean": self.mean.put(packer),
            "shapes": packer.add(self.shapes),
            "scale": self.scale.tolist(),
            "weights": self.weights.put(packer, differences=True),
        }


def _directions(moved: Floats) -> Floats:
    """Principal directions of (n_frames, m), the strongest first, as rows of unit length."""
    size, turned = np.linalg.eigh(moved @ moved.T)
    keep = size > 1e-12 * max(float(size[-1]), 1e-30)
    rows = (moved.T @ turned[:, keep]).T[::-1]
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def principal(points: Floats, tolerance: float) -> Modes:
    """Fewest components that keep every point within a tolerance in every frame.

    Parameters
    ----------
    points : (n_frames, n, 3), m
    tolerance : m
    """
    n_frames = len(points)
    mean = quantise(points.mean(axis=0))
    rest = (points - mean.values()).reshape(n_frames, -1)
    shapes, scales, columns = [], [], []

    def error() -> float:
        return float(np.linalg.norm(rest.reshape(n_frames, -1, 3), axis=2).max())

    for direction in _directions(rest)[:MOST_MODES]:
        if error() <= tolerance:
            break
        scale = float(np.abs(direction).max()) / LARGEST
        whole = np.round(direction / scale).astype(np.int16)
        seen = scale * whole
        weight = quantise((rest @ seen / (seen @ seen))[:, None])
        rest = rest - weight.values() * seen
        shapes.append(whole)
        scales.append(scale)
        columns.append(weight)
    empty = np.zeros((n_frames, 0))
    return Modes(
        mean=mean,
        shapes=np.array(shapes, dtype=np.int16).reshape(len(shapes), rest.shape[1]),
        scale=np.array(scales),
        weights=Quantised(
            whole=np.hstack([empty.astype(np.int16), *(c.whole for c in columns)]),
            low=np.concatenate([[], *(c.low for c in columns)]),
            scale=np.concatenate([[], *(c.scale for c in columns)]),
        ),
        error=error(),
    )
