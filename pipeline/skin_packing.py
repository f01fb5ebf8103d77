"""A bound skin as the page reads it: its rest, and what each vertex follows.

The page knows bodies and points already, so a skin costs the same for any number of frames.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.packing import Packer, quantise
from sim.skin.bound import BoundSkin

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

WHOLE = 65535
"""A weight of one."""


def whole_weights(weight: Floats) -> NDArray[np.uint16]:
    """Weights (n, k), rows of sum one, as whole numbers whose rows sum to `WHOLE`."""
    whole = np.round(WHOLE * weight).astype(np.int64)
    largest = np.argmax(whole, axis=1)
    whole[np.arange(len(whole)), largest] += WHOLE - whole.sum(axis=1)
    return whole.astype(np.uint16)


def pack_skin(
    packer: Packer, skin: BoundSkin, abdomen: Ints, *, moved: float, turned: float, soft: float
) -> tuple[dict[str, Any], float]:
    """Add a skin; return what the page needs and the largest error of a vertex, m.

    Parameters
    ----------
    abdomen : (n_abdomen,), where the abdomen's vertices lie in the pool of points
    moved, turned : largest errors of the bodies' places, m, and of the numbers of their turns
    soft : of the pool's points, m
    """
    n_bodies = len(skin.rest.bodies)
    whole = whole_weights(skin.weights.weight)
    used = whole > 0
    handle = skin.weights.handle[used]
    softs = np.unique(handle[handle >= n_bodies]) - n_bodies
    place = np.concatenate([np.arange(n_bodies), np.full(len(skin.rest.abdomen), 0)])
    place[n_bodies + softs] = n_bodies + np.arange(len(softs))
    rest, start = quantise(skin.vertices), quantise(skin.rest.abdomen[softs])
    row = np.nonzero(used)[0]
    on = handle < n_bodies
    arm = skin.vertices[row[on]] - skin.rest.position[handle[on]]
    far = float(np.linalg.norm(arm, axis=1).max(initial=0.0))
    stored = float(np.linalg.norm(rest.values() - skin.vertices, axis=1).max())
    begun = np.abs(start.values() - skin.rest.abdomen[softs]).max(initial=0.0)
    # a quaternion's error of e turns by at most about 4 e
    error = stored + max(moved + 4.0 * turned * far, soft + np.sqrt(3) * float(begun))
    told = {
        "rest": rest.put(packer),
        "count": packer.add(used.sum(axis=1).astype(np.uint8)),
        "handle": packer.add(place[handle].astype(np.uint16)),
        "weight": packer.add(whole[used]),
        "position": skin.rest.position.round(6).tolist(),
        "quaternion": skin.rest.quaternion.round(8).tolist(),
        "follow": packer.add(abdomen[softs].astype(np.uint16)),
        "start": start.put(packer),
    }
    return told, error + 1e-6
