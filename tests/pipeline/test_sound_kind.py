"""Which kind of sound: shares that add up, and the labelled recordings."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from pipeline.sound_kind import KINDS, MEASURES, kind_measures, tell_kind

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = 31
"""Right ones of 38 when each is left out of the fit (docs/methods/audio.md)."""


def test_shares_add_up() -> None:
    rng = np.random.default_rng(6)
    for _ in range(20):
        kind = tell_kind(dict(zip(MEASURES, 5 * rng.normal(size=len(MEASURES)), strict=True)))
        assert sum(kind.of_each.values()) == pytest.approx(1.0)
        assert kind.confidence == max(kind.of_each.values()) == kind.of_each[kind.kind]
        assert kind.kind in kind.sentence


def test_labelled_recordings(data_real: Path, targets) -> None:
    with (ROOT / "scripts" / "sound_labels.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] in KINDS]
    right = 0
    for row in rows:
        found, _, frames = targets.analyse(data_real / row["file"])
        right += tell_kind(kind_measures(found, frames)).kind == row["kind"]
    assert len(rows) == 38
    assert right >= LEFT_OUT
