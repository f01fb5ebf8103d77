"""How fast the torso runs: real-time factor, its parts, cost against its size.

`python benchmarks/torso.py` runs on one core and prints Markdown tables; medians of several runs.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np
from numba import njit

from sim import engine
from sim.bones import Bones, mj_comPos, mj_comVel, mj_kinematics, mj_makeM, mj_rne
from sim.breaths import sawtooth
from sim.model.torso import Subject
from sim.physics.borrow import borrow
from sim.physics.contact import add_contacts, follow_sheet
from sim.physics.forces import add_muscles, add_tissue
from sim.physics.plant import Plant
from sim.physics.rigid import move_points, place_points, project
from sim.physics.surface import press, volume_and_normals
from sim.physics.system import refresh, solve_step
from sim.physics.types import Floats
from sim.physics.work import Work
from sim.rest import GRAVITY, Machine, copy_state, no_record
from sim.resting import RestingTorso, rest_torso
from sim.simulate import REFRESH, SPEED_LIMIT, group_activation
from sim.tables import parameters

MAN = Subject(sex="male", stature=1.756, mass=75.0)
LEVELS = np.array([0.1, 0.06, 0.0, 0.0])
SIZES: tuple[dict[str, float], ...] = (
    {"intercostals_per_space": 7},
    {},
    {"intercostals_per_space": 28},
    {"intercostals_per_space": 56},
    {"diaphragm_rows": 5, "wall_rows": 5},
    {"diaphragm_rows": 10, "wall_rows": 10},
    {"diaphragm_rows": 14, "wall_rows": 14},
)
PARTS = ("kinematics (MuJoCo)", "bias forces (MuJoCo)", "inertia (MuJoCo)", "place and move points",
         "muscles", "tissue", "contact", "cavities", "projection", "solve", "refresh")  # fmt: skip


def activation(duration: float, step: float) -> Floats:
    """A calm breath of 4 s, over and over."""
    at = np.arange(round(duration / step), dtype=np.float64) * step
    inward, outward = sawtooth(at, inspiration=1.7, expiration=2.3, pause=0.4)
    return group_activation(np.stack([inward, inward, outward, outward], axis=1) * LEVELS)


def drive(machine: Machine, levels: Floats) -> engine.Drive:
    """Upright, nothing held."""
    return engine.make_drive(levels, gravity=GRAVITY["upright"], locked=np.zeros(machine.model.nv))


def real_time(resting: RestingTorso, step: float, duration: float) -> float:
    """Simulated over wall time of one run, after `BREATH_STEP`'s settings."""
    torso, state = resting.torso, copy_state(resting.upright.state)
    machine = Machine(torso)
    what = drive(machine, activation(duration, step))
    schedule = engine.Schedule(
        step=step, refresh_every=REFRESH, record_every=len(what.activation) + 1, drag=0.0,
        speed_limit=SPEED_LIMIT,
    )  # fmt: skip
    start = time.perf_counter()
    done = engine.run(
        machine.bones, torso.plant, machine.work, state, schedule, what, no_record(torso)
    )
    wall = time.perf_counter() - start
    if done < len(what.activation):
        raise SystemExit(f"the benchmark's breath diverged after {done * step:.3f} s")
    return duration / wall


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _part(
    which: int, n: int, bones: Bones, plant: Plant, work: Work, what: engine.Drive, step: float,
) -> None:  # fmt: skip
    bones, plant, work = borrow(bones), borrow(plant), borrow(work)
    k, tree, x, v, f = plant.constants, plant.tree, work.x, work.v, work.f
    for _ in range(n):
        if which == 0:
            mj_kinematics(bones.model, bones.data)
            mj_comPos(bones.model, bones.data)
            mj_comVel(bones.model, bones.data)
        elif which == 1:
            mj_rne(bones.model, bones.data, 0, work.bias.ctypes.data)
        elif which == 2:
            mj_makeM(bones.model, bones.data)
        elif which == 3:
            place_points(work.riders, plant.point_local, bones.position, bones.rotation, x)
            move_points(work.riders, tree.body_root, x, bones.spatial, bones.centre, v)
        elif which == 4:
            add_muscles(x, v, plant.muscles, k, what.activation[0], work.fibres, f)
        elif which == 5:
            add_tissue(x, v, plant.tissue, work.strings, f)
        elif which == 6:
            add_contacts(
                x, v, plant.contacts, k, work.held, work.ease, work.sheet_normal, work.gap, f
            )
        elif which == 7:
            volume_and_normals(x, plant.chest_faces, work.chest_normal)
            volume_and_normals(x, plant.abdomen_faces, work.abdomen_normal)
            press(x, plant.chest_faces, work.chest_normal, -490.0, np.zeros(3), f)
            press(x, plant.abdomen_faces, work.abdomen_normal, 900.0, 1e3 * what.gravity, f)
        elif which == 8:
            project(work.riders, tree, x, f, bones.centre, bones.motion, work.wrench, work.tau)
        elif which == 9:
            solve_step(tree, plant.pattern, work.matrix, work.change, 1.0, 1.0)
        else:
            refresh(plant, work, step, what.activation[0], bones.mass, what.locked,
                    bones.centre, bones.motion)  # fmt: skip


def part_costs(resting: RestingTorso, step: float, repeats: int) -> dict[str, float]:
    """Time of each part, s a call; the refresh serves `REFRESH` steps."""
    torso, machine = resting.torso, Machine(resting.torso)
    what, out = drive(machine, activation(1.0, step)[200:201]), np.empty(7)
    state, work = copy_state(resting.upright.state), machine.work
    machine.set_gravity(GRAVITY["upright"])
    engine.predict(machine.bones, torso.plant, work, state, step)
    follow_sheet(work.x, torso.plant.contacts, work.held, work.ease, 1.0, work.sheet_normal)
    _part(2, 1, machine.bones, torso.plant, work, what, step)
    engine.total_forces(machine.bones, torso.plant, work, state, what, 0, step, out)
    costs = {}
    for which, name in ((10, PARTS[10]), *enumerate(PARTS[:10])):
        n = 20 if which == 10 else 500
        work.f[:] = 0.0

        def go(which: int = which, n: int = n) -> None:
            _part(which, n, machine.bones, torso.plant, work, what, step)

        costs[name] = median_time(go, repeats) / n
    return costs


def median_time(go: Callable[[], None], repeats: int) -> float:
    """Median wall time of a call that has been compiled, s."""
    go()
    found = []
    for _ in range(repeats):
        start = time.perf_counter()
        go()
        found.append(time.perf_counter() - start)
    return statistics.median(found)


def size_of(resting: RestingTorso) -> tuple[int, int, int]:
    """Muscle elements, tissue threads, particles."""
    plant = resting.torso.plant
    return len(plant.muscles.a), len(plant.tissue.a), resting.torso.n_particles


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=7, help="runs a median is taken over")
    parser.add_argument("--duration", type=float, default=8.0, help="simulated s of each run")
    options = parser.parse_args()
    resting = rest_torso(MAN)
    real_time(resting, 0.002, 0.1)
    print("| step (ms) | real-time factor, median | least | greatest |\n|---|---|---|---|")
    for step in (0.002, 0.001):
        runs = [real_time(resting, step, options.duration) for _ in range(options.repeats)]
        print(f"| {1e3 * step:g} | {statistics.median(runs):.1f} | {min(runs):.1f} "
              f"| {max(runs):.1f} |")  # fmt: skip
    print("\n| part | µs a call | µs a step |\n|---|---|---|")
    for name, cost in part_costs(resting, 0.002, options.repeats).items():
        every = REFRESH if name in (PARTS[2], PARTS[10]) else 1
        print(f"| {name} | {1e6 * cost:.1f} | {1e6 * cost / every:.1f} |")
    print("\n| muscle elements | threads | particles | real-time factor at 2 ms | µs a step |")
    print("|---|---|---|---|---|")
    for change in SIZES:
        other = rest_torso(MAN, parameters=parameters().replace(**change))
        runs = [real_time(other, 0.002, options.duration) for _ in range(3)]
        factor = statistics.median(runs)
        elements, threads, particles = size_of(other)
        print(f"| {elements} | {threads} | {particles} | {factor:.1f} | {2000.0 / factor:.0f} |")


if __name__ == "__main__":
    main()
