"""What the Snakefile asks: the study, its jobs, and whether the targets exist."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from pipeline import calls_file, configuration
from pipeline.calibration_table import calibration_parts
from pipeline.configuration import STUDY_FILE, nearest_words
from pipeline.job import LAUGH, chain_of, make_job
from pipeline.study import RESERVED_END, Entry, Study, read_study
from sim.errors import InputError

RESULTS, REPORTS = Path("results"), Path("reports")
PHYSIOLOGY, PAPERS = RESULTS / "physiology", RESULTS / "papers"
PAGES = tuple(f"{REPORTS}/{page}" for page in ("error_table.html", "error_table.csv", "group.html"))
OTHER_PAGES = tuple(
    f"{REPORTS}/{folder.name}.{kind}" for folder in (PHYSIOLOGY, PAPERS) for kind in ("csv", "html")
)
"""Pages that are not about the study's recordings; only made when asked for."""
INDEX = f"{REPORTS}/index.html"


@dataclass(frozen=True, kw_only=True, slots=True)
class Plan:
    """A study and its checked configuration."""

    study: Study
    config: dict[str, Any]

    def job(self, name: str, stage: str) -> str:
        """Return the job of a rule as text."""
        edit = calls_file.edit_digest(RESULTS / name) if stage == "calls" else ""
        return make_job(self.study.entry(name), stage, self.config, edit).text

    def records(self, name: str) -> list[str]:
        """Return the records that the report of a row is made from."""
        stages = chain_of(self.study.entry(name).recording["kind"])
        return [f"{RESULTS}/{name}/{stage}.json" for stage in stages]

    def files(self, name: str) -> list[str]:
        """Return the files a row reads; none for a row that cannot be used."""
        entry = self.study.entry(name)
        if entry.problem:
            return []
        more = [str(entry.markers)] if entry.markers else []
        if entry.markers and entry.recording["kind"] == LAUGH:
            more += calibration_parts(entry.markers)
        return [str(entry.file), *more]

    @property
    def papers(self) -> str:
        """Settings of the papers' page as text."""
        return json.dumps(self.config["papers"], sort_keys=True)

    @property
    def everything(self) -> list[str]:
        """Every page of the study."""
        return [*(f"{REPORTS}/{name}.html" for name in self.study.names), *PAGES, INDEX]

    def indexed(self, targets: Collection[str]) -> list[str]:
        """Return the pages that the index waits for: those asked for with it.

        Parameters
        ----------
        targets : as typed; none or `all` asks for every page of the study
        """
        typed = [_normal(target) for target in targets]
        if not typed or "all" in typed:
            typed += self.everything
        known = {*self.everything, *OTHER_PAGES} - {INDEX}
        return sorted({one for one in typed if one in known and one.endswith(".html")})

    def others(self, targets: Collection[str]) -> list[str]:
        """Return name and time of the other pages there: the index is made anew for them."""
        waited = self.indexed(targets)
        pages = (one for one in sorted(REPORTS.glob("*.html")) if one.as_posix() != INDEX)
        return [f"{p.name} {p.stat().st_mtime_ns}" for p in pages if p.as_posix() not in waited]

    @property
    def lost(self) -> list[str]:
        """Problems of the rows that no report can be written for."""
        return [entry.problem for entry in self.study.entries if not entry.reportable]

    def asked(self, targets: Collection[str]) -> tuple[list[str], list[str]]:
        """Return the recordings that `targets` need, and the problems of rows without a report.

        Parameters
        ----------
        targets : as typed; none, a rule or a page of the study needs every row
        """
        about = [
            t
            for t in map(_normal, targets)
            if t not in (*OTHER_PAGES, PHYSIOLOGY.name, PAPERS.name, INDEX, "index")
        ]
        if targets and not about:
            return [], []
        # a retraining answers for its recording
        targets = {one.replace(f"{RESERVED_END}.html", ".html") for one in about}
        names = [n for n in self.study.names if f"{REPORTS}/{n}.html" in targets]
        if len(names) == len(targets) and targets:
            return names, []
        return list(self.study.names), self.lost


def _normal(target: str) -> str:
    return PurePosixPath(target).as_posix()


def read_plan(overrides: Mapping[str, Any], study_file: Path = STUDY_FILE) -> Plan:
    """Read configuration and tables of the study in the current folder.

    Parameters
    ----------
    overrides : keys given on the command line
    study_file : the study's own configuration
    """
    config = configuration.load(study_file, overrides)
    study = read_study(Path(config["recordings"]), Path(config["subjects"]))
    return Plan(study=study, config=config)


_WILDCARD = re.compile(r"\{name.*\}")


def check_targets(
    targets: Collection[str],
    rules: Collection[str],
    study: Study,
    made: Collection[str] = (),
) -> None:
    """Answer a mistyped report or file before any job runs.

    Parameters
    ----------
    targets : as typed
    rules : names of rules, which are targets too
    study : the rows that there are
    made : files that the rules make, `{name}` or `{name,constraint}` for a recording
    """
    files = {name.join(_WILDCARD.split(one)) for one in made for name in study.names}
    reports = [f"{REPORTS}/{name}.html" for name in study.names]
    for target in map(_normal, targets):
        if target in (*reports, *PAGES, *OTHER_PAGES, INDEX, *rules, *files):
            continue
        stems = {PurePosixPath(page).stem: page for page in (INDEX, *OTHER_PAGES, *PAGES, *reports)}
        close = nearest_words(PurePosixPath(target).stem, stems)
        near = " or ".join(stems[stem] for stem in close)
        some = ", ".join((*reports[:8], *PAGES, *OTHER_PAGES))
        listed = f" Did you mean {near}?" if near else f" There are: {some}."
        entry = _unreportable(target, study)
        why = f" ({entry.problem})" if entry else ""
        raise InputError(f"{target}: nothing of this name can be made{why}.{listed}")


def _unreportable(target: str, study: Study) -> Entry | None:
    return next(
        (e for e in study.entries if not e.reportable and target == f"{REPORTS}/{e.name}.html"),
        None,
    )


def check_installed() -> None:
    """Refuse to start when the stages' command is not on the path."""
    if shutil.which("pleura") is None:
        raise InputError("pleura: is not installed. pip install -c requirements.lock .")
