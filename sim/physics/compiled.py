"""Compile a kernel: no lock of the interpreter, cached on disk, its types kept."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compiled(function: Kernel) -> Kernel:
    """Compile `function` with numba; other kernels and Python may call it alike."""
    return cast(Kernel, njit(cache=True, nogil=True, error_model="numpy")(function))
