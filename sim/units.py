"""Factors to SI."""

from __future__ import annotations

PASCAL_PER_CMH2O = 98.0665
CUBIC_METRE_PER_LITRE = 1e-3
