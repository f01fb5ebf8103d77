"""Collects the points of the torso while it is being built."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.physics.types import Floats, Ints


@dataclass(slots=True)
class Points:
    """Bound points (a body each) and free particles, by their place at rest.

    Particles get negative handles while building, because their final index follows all bound
    points; `resolve` turns handles into indices.
    """

    body: list[int] = field(default_factory=list)
    bound: list[Floats] = field(default_factory=list)
    free: list[Floats] = field(default_factory=list)

    def add(self, body: int, at: Floats) -> int:
        """Add a point that rides on a body."""
        self.body.append(body)
        self.bound.append(np.asarray(at, dtype=float))
        return len(self.body) - 1

    def add_particle(self, at: Floats) -> int:
        """Add a free particle."""
        self.free.append(np.asarray(at, dtype=float))
        return -len(self.free)

    def at(self, handle: int) -> Floats:
        """Place at rest of a handle."""
        return self.bound[handle] if handle >= 0 else self.free[-handle - 1]

    def resolve(self, handles: object) -> Ints:
        """Final indices of handles."""
        h = np.asarray(handles, dtype=np.int64)
        return np.where(h >= 0, h, len(self.bound) - h - 1).astype(np.int64)

    def places(self) -> Floats:
        """(n_points, 3), all places at rest, bound points first."""
        return np.array([*self.bound, *self.free])
