"""MuJoCo for compiled code: its functions by address, and views of the arrays that are read."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import NamedTuple

import llvmlite.binding as llvm
import mujoco
from numba import types

from sim.physics.types import Floats

_CALLS = ("mj_kinematics", "mj_comPos", "mj_comVel", "mj_makeM", "mj_rne", "mj_integratePos")


def _register() -> None:
    """Make MuJoCo's functions known by name, so that compiled code can be cached on disk."""
    folder = Path(mujoco.__file__).parent
    library = ctypes.CDLL(str(next(folder.glob("libmujoco.so*"))))
    for name in _CALLS:
        address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        llvm.add_symbol(name, address)


_register()
_POINTER = types.uintp
_PAIR = types.void(_POINTER, _POINTER)
mj_kinematics = types.ExternalFunction("mj_kinematics", _PAIR)
mj_comPos = types.ExternalFunction("mj_comPos", _PAIR)
mj_comVel = types.ExternalFunction("mj_comVel", _PAIR)
mj_makeM = types.ExternalFunction("mj_makeM", _PAIR)
mj_rne = types.ExternalFunction("mj_rne", types.void(_POINTER, _POINTER, types.int32, _POINTER))
mj_integratePos = types.ExternalFunction(
    "mj_integratePos", types.void(_POINTER, _POINTER, _POINTER, types.float64)
)


class Bones(NamedTuple):
    """MuJoCo's model and data by address, and views of the arrays that the loop reads."""

    model: int
    data: int
    qpos: Floats
    qvel: Floats
    position: Floats
    rotation: Floats
    centre: Floats
    motion: Floats
    spatial: Floats
    mass: Floats


def view_bones(model: mujoco.MjModel, data: mujoco.MjData) -> Bones:
    """Views into `data`, which must outlive them."""
    return Bones(
        model=model._address,
        data=data._address,
        qpos=data.qpos,
        qvel=data.qvel,
        position=data.xpos,
        rotation=data.xmat.reshape(-1, 9),
        centre=data.subtree_com,
        motion=data.cdof,
        spatial=data.cvel,
        mass=data.M,
    )
