"""Compile a kernel: no lock of the interpreter, cached on disk, its types kept."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    # Sums may be fused and taken in another order, the same one at every run; what is not a number
    # stays so, as divergence is told by it.
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}


def compiled(function: Kernel) -> Kernel:
    """Compile `function` with numba; other kernels and Python may call it alike."""
    return cast(Kernel, njit(**OPTIONS)(function))


def inner(function: Kernel) -> Kernel:
    """Compile a function that only kernels call: nothing is compiled to unpack Python's tuples."""
    return cast(Kernel, njit(**OPTIONS, no_cpython_wrapper=True)(function))
