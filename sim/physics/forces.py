"""Forces of muscles, tissue and links on the points of the torso."""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import compiled, inner
from sim.physics.muscle import (
    HILL,
    active_factor,
    active_slopes,
    exponential,
    hill_tension,
    passive_shape,
    spring_tension,
)
from sim.physics.plant import Constants, Links, Muscles, Tissue
from sim.physics.threads import measure, pull
from sim.physics.types import Floats, Ints
from sim.physics.work import Fibres, Strings

STEEPEST = 4.0
"""Exponent up to which a thread stiffens: 55 times its stiffness at slack."""


ENOUGH = 0.75
"""Of a matrix that bounds the true one: with forces taken at x + h v, where the present velocities
lead, the step is stable as long as the true matrix is at most 4/3 of the one it solves."""


@inner
def _measure_chains(muscles: Muscles, fibres: Fibres) -> None:
    """Length and speed of each fibre: the sums over its elements."""
    fibres.span[:] = 0.0
    fibres.speed[:] = 0.0
    for e in range(muscles.chain.shape[0]):
        c = np.uintp(muscles.chain[e])
        fibres.span[c] += fibres.length[e]
        fibres.speed[c] += fibres.rate[e]


@inner
def _element_drive(level: float, share: float, late: float, recruited: float) -> float:
    """Activation of an element that has a share of its group's drive.

    The share grows by `late` as the group's activation goes from `recruited` to one: in a maximal
    effort more fibres work.
    """
    above = max(0.0, level - recruited) / max(1.0 - recruited, 1e-9)
    return level * (share + above * late)


@inner
def _hill_tensions(
    muscles: Muscles, constants: Constants, activation: Floats, fibres: Fibres
) -> None:
    for c in range(muscles.chain_rest.shape[0]):
        rest = muscles.chain_rest[c]
        fibres.factor[c] = active_factor(
            fibres.span[c] / rest,
            fibres.speed[c] / (rest * muscles.chain_v_max[c]),
            constants.width,
            constants.curvature,
            constants.eccentric,
        )
    for e in range(muscles.rest.shape[0]):
        level = _element_drive(
            activation[np.uintp(muscles.group[e])],
            muscles.share[e],
            muscles.late[e],
            constants.recruited,
        )
        fibres.tension[e] = level * fibres.factor[np.uintp(muscles.chain[e])]
    # Nothing is looked up here, so elements are taken several at a time.
    for e in range(muscles.rest.shape[0]):
        per_rest = 1.0 / muscles.rest[e]
        fibres.tension[e] = hill_tension(
            fibres.tension[e],
            fibres.length[e] * per_rest,
            fibres.rate[e] * per_rest,
            muscles.f_max[e],
            muscles.k_pe[e],
            muscles.b_pe[e],
        )


@inner
def _spring_tensions(muscles: Muscles, activation: Floats, fibres: Fibres) -> None:
    for e in range(muscles.rest.shape[0]):
        fibres.tension[e] = spring_tension(
            activation[muscles.group[e]] * muscles.share[e],
            fibres.length[e],
            fibres.rate[e],
            muscles.rest[e],
            muscles.chain_v_max[muscles.chain[e]],
            muscles.f_max[e],
            muscles.k_pe[e],
            muscles.b_pe[e],
        )


@compiled
def add_muscles(
    x: Floats,
    v: Floats,
    muscles: Muscles,
    constants: Constants,
    activation: Floats,
    fibres: Fibres,
    f: Floats,
) -> None:
    """Add the tension of every muscle element to the nodal forces.

    Parameters
    ----------
    x, v : (n_points, 3), m and m/s
    activation : (n_groups,)
    fibres : written
    f : (n_points, 3), N, added to
    """
    measure(x, v, muscles.a, muscles.b, fibres.length, fibres.rate)
    _measure_chains(muscles, fibres)
    if constants.law == HILL:
        _hill_tensions(muscles, constants, activation, fibres)
    else:
        _spring_tensions(muscles, activation, fibres)
    pull(x, muscles.a, muscles.b, fibres.length, fibres.tension, f)


@compiled
def muscle_masses(
    step: float,
    muscles: Muscles,
    constants: Constants,
    activation: Floats,
    fibres: Fibres,
    out: Floats,
) -> None:
    """Bound on h^2 K + h D of every element along its line, as an added mass, kg.

    The active part of a chain couples all its elements; n times the fibre's own slope on each
    element bounds that coupling from above, and equals it when the fibre shortens evenly;
    `ENOUGH` of it is taken.

    Parameters
    ----------
    fibres : as `add_muscles` left them
    out : (n_elements,), written
    """
    for e in range(out.shape[0]):
        level = _element_drive(
            activation[muscles.group[e]], muscles.share[e], muscles.late[e], constants.recruited
        )
        rest = muscles.rest[e]
        if constants.law != HILL:
            k = level * muscles.f_max[e] + muscles.k_pe[e]
            out[e] = step * step * k + step * muscles.b_pe[e]
            continue
        chain = muscles.chain[e]
        ratio = fibres.span[chain] / muscles.chain_rest[chain]
        k = muscles.k_pe[e] * passive_shape(fibres.length[e] / rest)[1] / rest
        d = muscles.b_pe[e] / rest
        count = max(1.0, ENOUGH * muscles.chain_count[chain])
        force = level * muscles.f_max[e] * count / muscles.chain_rest[chain]
        slopes = active_slopes(
            ratio, constants.width, constants.curvature, muscles.chain_v_max[chain]
        )
        k += force * slopes[0]
        d += force * slopes[1]
        out[e] = step * step * k + step * d


@compiled
def add_tissue(x: Floats, v: Floats, tissue: Tissue, strings: Strings, f: Floats) -> None:
    """Add the pull of the passive threads; `strings` is written.

    A thread with a curve c pulls k l0 (e^(c s) - 1) / c at a strain s, so that k is its stiffness
    at its slack length l0; past `STEEPEST` it goes on along its tangent.
    """
    length, rate, tension = strings.length, strings.rate, strings.tension
    measure(x, v, tissue.a, tissue.b, length, rate)
    for e in range(length.shape[0]):
        # Without a branch, so threads are taken several at a time: a straight line is 0 / 1.
        stiffness, curve = tissue.stiffness[e], tissue.curve[e]
        stretch, curved = length[e] - tissue.rest[e], curve > 0.0
        power = curve * stretch / tissue.rest[e]
        kept = min(power, STEEPEST)
        grown = exponential(kept)
        bent = tissue.rest[e] * (grown * (1.0 + power - kept) - 1.0) / (curve if curved else 1.0)
        force = stiffness * (bent if curved else stretch) + tissue.damping[e] * rate[e]
        strings.slope[e] = stiffness * grown
        tension[e] = force if tissue.pushes[e] == 1 else max(0.0, force)
    pull(x, tissue.a, tissue.b, length, tension, f)


@compiled
def stiffest_soon(tissue: Tissue, strings: Strings, time: float, out: Floats) -> None:
    """Write the stiffness that each thread comes to if it stretches on at its speed for `time`, s.

    A thread that shortens keeps its present one.

    Parameters
    ----------
    out : (n_threads,), N/m
    """
    for e in range(out.shape[0]):
        strain = time * max(0.0, strings.rate[e]) / tissue.rest[e]
        grown = strings.slope[e] * exponential(min(tissue.curve[e] * strain, STEEPEST))
        most = tissue.stiffness[e] * exponential(STEEPEST)
        out[e] = max(strings.slope[e], min(grown, most))


@compiled
def link_axis(links: Links, e: int, point_body: Ints, rotation: Floats, out: Floats) -> None:
    """Direction of a link's cartilage in the world.

    Parameters
    ----------
    rotation : (n_bodies, 9), body to world
    out : (3,), written
    """
    r, s = rotation[point_body[links.b[e]]], links.axis[e]
    for c in range(3):
        out[c] = r[3 * c] * s[0] + r[3 * c + 1] * s[1] + r[3 * c + 2] * s[2]


@compiled
def add_links(
    x: Floats, v: Floats, links: Links, point_body: Ints, rotation: Floats, f: Floats
) -> None:
    """Add the forces of the bone-to-cartilage links, which are slack when both ends meet."""
    axis = np.empty(3)
    for e in range(links.a.shape[0]):
        a, b = links.a[e], links.b[e]
        link_axis(links, e, point_body, rotation, axis)
        stretch = 0.0
        for c in range(3):
            stretch += axis[c] * (x[b, c] - x[a, c])
        for c in range(3):
            pull = links.across[e] * (x[b, c] - x[a, c])
            pull += (links.along[e] - links.across[e]) * stretch * axis[c]
            pull += links.damping[e] * (v[b, c] - v[a, c])
            f[a, c] += pull
            f[b, c] -= pull
