"""A study in a temporary folder, and stages' records without a torso."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright

from pipeline.job import make_job
from pipeline.new_study import create
from pipeline.status import write_ok, write_unusable
from pipeline.workflow import read_plan

CHROMIUM = "/usr/bin/chromium"
# No sandbox: tests run as root. The rest keeps the browser from looking for its maker's hosts.
BROWSER_FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
RECORDING = ("recording", "kind", "subject", "path", "start_s", "end_s", "markers")
SUBJECT = ("subject", "sex", "stature_m", "mass_kg", "posture")


class StudyFolder:
    """A study whose tables tests write row by row."""

    def __init__(self, folder: Path) -> None:
        create(folder)
        self.folder = folder
        self.recordings = folder / "config" / "recordings.tsv"
        self.subjects = folder / "config" / "subjects.tsv"
        self.people(("p1", "female", "1.65", "60", "upright"))

    def rows(self, *rows, header=RECORDING):
        lines = ["\t".join(cells) for cells in (header, *rows)]
        self.recordings.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def people(self, *rows, header=SUBJECT):
        lines = ["\t".join(cells) for cells in (header, *rows)]
        self.subjects.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def recording_file(self, name="first.c3d", content=b"not empty"):
        (self.folder / "data" / name).write_bytes(content)
        return f"../data/{name}"

    def run(self, *words, timeout=120):
        """Run a command in the study as a person would."""
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        return subprocess.run(
            words,
            cwd=self.folder,
            env={**os.environ, "PATH": path},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )


@pytest.fixture
def study(tmp_path):
    return StudyFolder(tmp_path / "study")


@pytest.fixture
def in_study(study, monkeypatch):
    """The study as the current folder."""
    monkeypatch.chdir(study.folder)
    return study


@pytest.fixture
def finished(in_study):
    """Records of one good and one unusable recording, as the stages would leave them."""
    path = in_study.recording_file()
    in_study.rows(("good", "breath", "p1", path), ("bad", "breath", "p1", path))
    plan = read_plan({})
    results = in_study.folder / "results"
    content = {
        "markers": {"labels": ["A"], "names": ["STRN"], "quality": {"noise_mm": {"A": 0.1}}},
        "signature": {
            "inspiration_time_s": 1.5,
            "expiration_time_s": 2.5,
            "n_used": 8,
            "n_cycles": 9,
        },
        "fit": {"warnings": ["the <abdomen> hardly matters"]},
        "posterior": {"identifiability": ["the markers tell all four groups apart"]},
    }
    for stage, facts in content.items():
        job = make_job(plan.study.entry("good"), stage, plan.config)
        write_ok(results / "good" / f"{stage}.json", job, facts, 1.0)
        job = make_job(plan.study.entry("bad"), stage, plan.config)
        reason = "first.c3d: is not a <b>C3D</b> file. Export it again."
        record = results / "bad" / f"{stage}.json"
        write_unusable(record, job, reason, stage="markers", status="unusable")
    (results / "good" / "errors.csv").write_text(
        "scope,error_p_mm,error_v_mm_s,error_p_still_mm,n_cycles,verdict\n"
        "signature_all,0.2,1.0,1.0,1,explains 80 % of the displacement\n"
        "cycles_all,0.4,2.0,1.0,8,explains 60 % of the displacement\n",
        encoding="utf-8",
    )
    header = "scope,id,group,level,low,high,probability,n_cycles,at_bound\n"
    groups = ("external_intercostals", "diaphragm", "internal_intercostals", "abdomen")
    lines = [f"subject_mean,good,{g},0.{k + 1},0.05,0.6,0.9,8,no\n" for k, g in enumerate(groups)]
    lines += [f"cycle,{c},{g},0.2,0.1,0.3,0.9,1,no\n" for c in range(8) for g in groups]
    (results / "good" / "activations.csv").write_text(header + "".join(lines), encoding="utf-8")
    return in_study


@pytest.fixture
def keep():
    """Keep a file among what `.ci/run` leaves to be looked at; elsewhere nothing is kept."""
    folder = os.environ.get("PLEURA_CI_OUTPUT")

    def keep_file(path, kind="pages"):
        if folder:
            (Path(folder) / kind).mkdir(parents=True, exist_ok=True)
            shutil.copy(path, Path(folder) / kind)

    return keep_file


@pytest.fixture
def browser():
    if not shutil.which(CHROMIUM):
        pytest.skip("no chromium: apt-get install chromium")
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=list(BROWSER_FLAGS))
        yield opened
        opened.close()
