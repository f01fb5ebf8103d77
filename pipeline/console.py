"""What a person sees of a run: one line a fact, in place of Snakemake's pages."""

from __future__ import annotations

import atexit
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline.status import EVERY_RECORD, belongs, first_problem

# What Snakemake adds after an error it has already told.
ECHOES = ("Exiting because a job", "At least one job", "RuleException", "CalledProcessError")


def say(line: str) -> None:
    """Print one line on standard error at once."""
    print(line, file=sys.stderr, flush=True)


class OneLiners(logging.Handler):
    """Turns Snakemake's errors into one line each; everything else stays in its own log.

    `worked` tells whether jobs ran, or none had to.
    """

    worked = False

    def emit(self, record: logging.LogRecord) -> None:
        """Print the record if it is an error that was not told yet."""
        text = record.getMessage()
        event = str(getattr(record, "event", ""))
        if event == "job_started":
            self.worked = True
        if text.startswith("Nothing to be done"):
            self.worked = True
            say("Nothing to be done: everything asked for is up to date.")
        if record.levelno < logging.ERROR:
            return
        if event == "job_error":
            logs = ", ".join(str(log) for log in getattr(record, "log", None) or [])
            rule = getattr(record, "rule_name", "a stage")
            say(f"{rule}: was stopped before it finished; run again. See {logs or 'logs/'}.")
        elif "cannot be locked" in text:
            say(
                "This folder is locked: another run is going on, or one was killed. If none is:"
                " snakemake --unlock"
            )
        elif not any(echo in text for echo in ECHOES):
            say(" ".join(text.split()))


def verdict(names: Sequence[str], problems: Sequence[str], results: Path) -> list[str]:
    """Return one line for every row that could not be used.

    Parameters
    ----------
    names : recordings that were asked for
    problems : lines about rows that have no report
    results : folder of the stages' records
    """
    lines = list(problems)
    for name in names:
        folder = results / name
        ran = [stage for stage in EVERY_RECORD if belongs(folder, stage)]
        record = first_problem(folder, ran)
        if record is not None:
            lines.append(f"{name}: {record['reason']}")
    return lines


def conclude(told: OneLiners, names: Sequence[str], problems: Sequence[str], results: Path) -> None:
    """Tell at the end of the process what could not be used, and then end with exit code 1.

    Snakemake counts a row's status record as a success, and runs no rule when all is up to date,
    so the code has to be set once Snakemake itself is done.
    """

    def at_exit() -> None:
        lines = verdict(names, problems, results) if told.worked else []
        for line in lines:
            say(f"Not used: {line}")
        if lines:
            sys.stdout.flush()
            logging.shutdown()
            os._exit(1)

    atexit.register(at_exit)
