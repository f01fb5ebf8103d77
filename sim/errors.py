"""Errors a user can act on: file, place, what is wrong, how to mend it."""

from __future__ import annotations

from pathlib import Path


class TorsoError(Exception):
    """Root of every error that Pleura raises on purpose."""


class ParameterError(TorsoError):
    """A parameter or setting is outside what the model accepts."""


class ControlFileError(TorsoError):
    """A control file cannot be read."""


class InputError(TorsoError):
    """A recording or table cannot be used."""


class UnstableSimulation(TorsoError):
    """A run diverged; the dump reproduces it.

    Parameters
    ----------
    message : one line: time, largest speeds
    dump : file with the state just before the divergence, if one was written
    """

    def __init__(self, message: str, dump: Path | None = None) -> None:
        super().__init__(message if dump is None else f"{message} State saved in {dump}.")
        self.dump = dump
