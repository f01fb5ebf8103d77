"""What one stage is asked to do for one recording, as the workflow hands it over."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from pipeline import configuration, places
from pipeline.study import Entry, Row
from sim.errors import InputError

SECTIONS_OF = {
    "markers": ("markers",),
    "signature": ("signature",),
    "fit": ("fit",),
    "posterior": ("fit", "posterior"),
    "audio": ("audio", "calls"),
    "pressure": ("audio", "pressure", "calls"),
    "calls": ("calls",),
    "follow": ("follow",),
    "retraining": ("retraining",),
    "report": (),
}
BREATH, LAUGH = "breath", "laugh"
CHAINS = {
    BREATH: ("markers", "signature", "fit", "posterior"),
    LAUGH: ("audio", "pressure", "calls", "follow"),
}
"""Stages of each kind of recording, in order; each needs those before it."""
BESIDE = {"retraining": (BREATH, "fit")}
"""Stages beside a chain, made when asked for: the kind that they are of, and what they need."""


def chain_of(kind: str) -> tuple[str, ...]:
    """Stages of a kind; a row without a kind that is known is a breath's."""
    return CHAINS.get(kind, CHAINS[BREATH])


def stages_of(kind: str) -> tuple[str, ...]:
    """Stages of a kind, those beside its chain at the end."""
    beside = (stage for stage, (of, _) in BESIDE.items() if chain_of(of) == chain_of(kind))
    return (*chain_of(kind), *beside)


def stages_before(stage: str, kind: str) -> tuple[str, ...]:
    """Stages that one needs, in order; none for a stage of another kind."""
    chain = chain_of(kind)
    if stage in BESIDE and stage in stages_of(kind):
        return chain[: chain.index(BESIDE[stage][1]) + 1]
    return chain[: chain.index(stage)] if stage in chain else ()


@dataclass(frozen=True, kw_only=True, slots=True)
class Job:
    """One stage of one recording; Snakemake reruns the stage when any field changes.

    Parameters
    ----------
    name, stage : what and which
    recording, subject : rows of the tables
    file, markers : paths; `markers` may be empty
    problem : why the row cannot be used, empty if it can
    settings : section name to values
    torso : digest of the simulation's code and tables
    edit : digest of what a person changed in the stage's table, empty where nothing was
    """

    name: str
    stage: str
    recording: Row
    subject: Row
    file: str
    markers: str
    problem: str
    settings: dict[str, dict[str, Any]]
    seed: int
    version: str
    torso: str = ""
    edit: str = ""

    @property
    def kind(self) -> str:
        """Kind of the recording."""
        return self.recording.get("kind", BREATH)

    @property
    def text(self) -> str:
        """The job as one line of JSON."""
        return json.dumps(asdict(self), sort_keys=True, ensure_ascii=False)

    def section(self, name: str) -> Any:
        """Return the checked settings dataclass of a stage."""
        return configuration.section(name, self.settings[name], "settings")


def make_job(entry: Entry, stage: str, config: Mapping[str, Any], edit: str = "") -> Job:
    """Return the job of `stage` for one row.

    Parameters
    ----------
    entry : the row
    stage : one of STAGES
    config : a checked configuration
    edit : digest of what a person changed in the stage's table
    """
    problem, kind = entry.problem, entry.recording.get("kind", BREATH)
    if not problem and stage != "report" and stage not in stages_of(kind):
        stages = ", ".join(stages_of(kind))
        problem = f"recording {entry.name}: is a {kind}, whose stages are {stages}. Ask for those."
    return Job(
        name=entry.name,
        stage=stage,
        recording=entry.recording,
        subject=entry.subject,
        file=str(entry.file),
        markers=str(entry.markers or ""),
        problem=problem,
        settings={name: dict(config[name]) for name in SECTIONS_OF[stage]},
        seed=config["seed"],
        version=places.version(),
        torso=places.torso_code(),
        edit=edit,
    )


def read_job(text: str) -> Job:
    """Read what `Job.text` wrote."""
    try:
        return Job(**json.loads(text))
    except (ValueError, TypeError) as error:
        raise InputError(f"--job: is not a job ({error}). Leave it out.") from error
