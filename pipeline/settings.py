"""One frozen dataclass of settings a stage; the values live in config/config.yaml alone."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True, slots=True)
class MarkerSettings:
    """Reading and cleaning a recording."""

    max_gap_s: float


@dataclass(frozen=True, kw_only=True, slots=True)
class SignatureSettings:
    """Finding breaths and averaging them."""

    n_phase: int


@dataclass(frozen=True, kw_only=True, slots=True)
class FitSettings:
    """Fitting the torso to a breath signature."""

    algorithm: str


@dataclass(frozen=True, kw_only=True, slots=True)
class PosteriorSettings:
    """Emulator and sampling."""

    n_design: int
