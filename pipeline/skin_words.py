"""Words of `pleura skin`, known without loading what does it."""

from __future__ import annotations

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Metres."""
UPS = {"y": ((2, 0, 1), (1.0, 1.0, 1.0)), "z": ((1, 0, 2), (-1.0, 1.0, 1.0))}
"""Columns and signs that make X forward, Y left, Z up: glTF's axes, and those with -Y forward."""
METHODS = ("smooth", "nearest")
"""Of binding: ours, the published one."""
