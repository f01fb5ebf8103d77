"""Fixtures that the tests of the simulator share: a torso is solved once a session."""

from __future__ import annotations

import pytest

from sim.model.torso import Subject
from sim.resting import RestingTorso, rest_torso


@pytest.fixture(scope="session")
def resting() -> RestingTorso:
    """The reference man at rest; upright is solved, lying down is found when first asked for."""
    return rest_torso(Subject(sex="male", stature=1.756, mass=75.0))
