"""The passive belly wall: threads that go on over the ribs."""

from __future__ import annotations

import numpy as np

from sim.model.torso import Subject, build_torso
from sim.physics.plant import Tissue
from sim.physics.types import Floats
from sim.tables import parameters

MAN = Subject(sex="male", stature=1.756, mass=75.0)


def test_threads_of_the_wall_are_the_ends_of_longer_ones() -> None:
    """The part on the ribs makes a column softer, and leaves its tension where it was."""
    p = parameters()
    short, long = (
        build_torso(MAN, parameters=p.replace(wall_reach=reach)).plant.tissue
        for reach in (0.0, 0.2)
    )
    changed = short.stiffness != long.stiffness
    assert changed.sum() > 300
    built = short.rest[changed] / p["belly_slack_sagittal"]

    def tension(tissue: Tissue, stretch: float) -> Floats:
        rest, curve = tissue.rest[changed], tissue.curve[changed]
        strain = built * stretch / rest - 1.0
        return np.asarray(tissue.stiffness[changed] * rest * np.expm1(curve * strain) / curve)

    np.testing.assert_allclose(tension(long, 1.0), tension(short, 1.0), rtol=1e-9)
    assert np.all(tension(long, 1.2) < 0.8 * tension(short, 1.2))
