"""Fixtures that every part's tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def data_real() -> Path:
    """Folder of real recordings next to the repository; they are never part of it."""
    folder = ROOT.parent / "shared" / "data_real"
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside the repository")
    return folder


@pytest.fixture(scope="session")
def data_samples() -> Path:
    """Folder of the synthetic subjects that the repository carries."""
    return ROOT / "data_samples"
