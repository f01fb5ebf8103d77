"""One heavy part of the papers' page."""

from __future__ import annotations

import json
from pathlib import Path

from pipeline import configuration
from pipeline.configuration import STUDY_FILE
from pipeline.settings import PapersSettings
from sim.errors import InputError


def read_settings(text: str | None) -> PapersSettings:
    """Settings as the workflow hands them over, else those of the study in this folder."""
    if text is None:
        values = configuration.load(STUDY_FILE, {})["papers"]
    else:
        try:
            values = json.loads(text)
        except ValueError as error:
            raise InputError(f"--settings: is not JSON ({error}). Leave it out.") from error
    settings = configuration.section("papers", values, "settings")
    if not isinstance(settings, PapersSettings):
        raise InputError("--settings: are not those of the papers. Leave them out.")
    return settings


def make_part(part: str, folder: Path, settings: str | None, processes: int) -> Path:
    """Make a part and return its record.

    Parameters
    ----------
    part : a form of the behaviours, "papers", "calibrated" or "papers_set"; "map"; "experiments"
    folder : results of the page
    settings : JSON, or nothing
    processes : threads of the map
    """
    checked = read_settings(settings)
    if part == "map":
        from pipeline.papers.breath_map import run_map

        return run_map(folder, checked, processes)
    if part == "experiments":
        from pipeline.papers.experiments import run_experiments

        return run_experiments(folder, checked)
    from pipeline.papers.behaviours import simulate_form

    return simulate_form(part, folder)
