"""Libraries that are installed only where somebody wants them."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from sim.errors import InputError


def need(modules: tuple[str, ...], *, extra: str, out: Path) -> None:
    """Refuse to write `out` where a library of an extra is not installed.

    Parameters
    ----------
    modules : names as they are imported
    extra : of `pyproject.toml`, that brings them
    """
    lacking = [name for name in modules if importlib.util.find_spec(name) is None]
    if lacking:
        raise InputError(
            f"{out}: {' and '.join(lacking)} not installed. Where Pleura was installed from, run:"
            f" pip install -c requirements.lock '.[{extra}]'"
        )
