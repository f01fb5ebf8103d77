"""Ties between ribs, cartilages and sternum."""

from __future__ import annotations

import numpy as np

from sim.model.anatomy import Anatomy
from sim.model.points import Points
from sim.model.skeleton import Skeleton
from sim.physics.plant import Links
from sim.tables import Parameters


def build_links(points: Points, skeleton: Skeleton, anatomy: Anatomy, p: Parameters) -> Links:
    """Ties between ribs, cartilages and sternum.

    A rib's tip rides on its cartilage. Rib and cartilage are also one bar, joined to the sternum
    by a joint that turns: a rib that turns carries the sternum along, as far as the cartilage, a
    cantilever of length L, does not bend (3 E I / L^3). Along its chord a cartilage is as soft as
    its bend lets it be, a bent bar, so that goes with 1 / L^3 too: the short ones of the upper ribs
    hold, the long ones of ribs 5 to 7 give. Stiffnesses go with the size, as those of bodies of one
    shape and material.
    """
    a, b, axes, along, across = [], [], [], [], []
    size = float(np.prod(anatomy.scale)) ** (1.0 / 3.0)
    rigidity = 3.0 * p["cartilage_modulus"] * p["cartilage_second_moment"] * size**4
    for side, letter in enumerate("LR"):
        for rib in range(1, 11):
            tip = anatomy.rib[side, rib - 1, -1]
            inner = anatomy.facet[side, min(rib, 7) - 1]
            part = f"cartilage_{letter}{rib}" if 2 <= rib < 6 else f"cartilage_{letter}6-10"
            part = "sternum" if rib == 1 else part
            a.append(points.add(skeleton.body[f"rib_{letter}{rib}"], tip))
            b.append(points.add(skeleton.body[part], tip))
            length = float(np.linalg.norm(inner - tip))
            axes.append((inner - tip) / length)
            kind = "first" if rib == 1 else "true" if rib <= 7 else "false"
            slender = (size * p["link_length"] / length) ** 3 if kind == "true" else 1.0
            along.append(size * slender * p[f"link_along_{kind}"])
            across.append(size * p[f"link_across_{kind}"])
            if kind == "true":
                a.append(points.add(skeleton.body[f"rib_{letter}{rib}"], inner))
                b.append(points.add(skeleton.body["sternum"], inner))
                axes.append(axes[-1])
                along.append(size * slender * p["bar_along"])
                across.append(rigidity / length**3)
    return Links(
        a=points.resolve(a),
        b=points.resolve(b),
        axis=np.array(axes),
        along=np.array(along),
        across=np.array(across),
        damping=np.full(len(a), p["link_damping"]),
    )
