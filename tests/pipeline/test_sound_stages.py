"""Stages audio, pressure, calls of whole recordings: files, edits, every real sound."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline import configuration, places, status
from pipeline.configuration import read_yaml
from pipeline.job import CHAINS, LAUGH, Job, make_job
from pipeline.laugh import desired_laugh
from pipeline.laugh_report import write_laugh_report
from pipeline.run import run_stage
from pipeline.sound_stages import STAGES
from pipeline.study import Entry
from sim.errors import InputError, TorsoError

SOUNDS = {".wav", ".flac", ".ogg", ".mp3"}
ANSWERED = {
    "2XgDqz_cough-shallow_ALLZERO.flac",
    "9XKj7f_cough-heavy_EMPTY.wav",
    "bursting_out_laughing_skeleton.ogg",
}


def job_of(stage: str, file: Path, calibration: Path | None = None, **cells: str) -> Job:
    row = {"recording": "one", "kind": LAUGH, "subject": "p1", "start_s": "", "end_s": ""}
    entry = Entry(
        name="one",
        recording={**row, **cells},
        subject={"subject": "p1", "sex": "female"},
        file=file,
        markers=calibration,
        problem="",
        reportable=True,
    )
    return make_job(entry, stage, configuration.load(None, {}))


def run(folder: Path, file: Path, calibration: Path | None = None, **cells: str) -> list[str]:
    return [
        run_stage(STAGES[stage], job_of(stage, file, calibration, **cells), folder, 1)
        for stage in CHAINS[LAUGH][:3]
    ]


def test_a_calibrated_laugh(data_samples: Path, tmp_path: Path) -> None:
    table = data_samples / "calibration" / "calibration.tsv"
    run(tmp_path, data_samples / "laugh1.flac", table)
    rows = pd.read_csv(tmp_path / "pressure.csv")
    assert list(rows) == ["time_s", "pressure_cmh2o", "low", "high", "calibrated"]
    assert set(rows["calibrated"]) == {"yes"}
    assert (
        (rows["low"] <= rows["pressure_cmh2o"]) & (rows["pressure_cmh2o"] <= rows["high"])
    ).all()
    calls = pd.read_csv(tmp_path / "calls.csv")
    assert list(calls) == [
        "call", "start_s", "peak_s", "end_s", "peak", "bout", "voiced", "kept", "why_not"
    ]  # fmt: skip
    record = status.read_status(tmp_path, "pressure")
    assert record["calibration"]["n_subjects"] == 3
    left_out = record["calibration"]["left_out_subject"]
    assert left_out["low"] < left_out["r"] < left_out["high"]
    desired = desired_laugh(tmp_path)
    assert desired.calibrated and len(desired.calls) == 6
    assert desired.rate == 1000.0
    assert np.allclose(np.diff(desired.time), 1e-3)
    for name in ("calls.svg", "spectrogram.svg"):
        ElementTree.fromstring((tmp_path / name).read_text())
    page = write_laugh_report(tmp_path, tmp_path / "page.html").read_text()
    assert "http:" not in page.replace("http://www.w3.org", "")


def test_an_edit_survives_until_the_table_is_deleted(data_samples: Path, tmp_path: Path) -> None:
    sound = data_samples / "laugh1.flac"
    run(tmp_path, sound)
    table = tmp_path / "calls.csv"
    first = table.read_text()
    rows = first.splitlines()
    table.write_text("\n".join([rows[0], rows[1], rows[2].replace("yes,yes,", "yes,no,"), ""]))
    edited = table.read_text()
    line = run(tmp_path, sound)[-1]
    assert "1 call in 1 bout, calls.csv edited by hand" in line
    assert table.read_text() == edited
    assert len(desired_laugh(tmp_path).calls) == 1
    table.unlink()
    run(tmp_path, sound)
    assert table.read_text() == first


def test_no_laugh_is_said_and_can_be_overruled(tmp_path: Path) -> None:
    import soundfile

    rng = np.random.default_rng(5)
    soundfile.write(tmp_path / "noise.wav", rng.normal(0, 0.1, 32000), 16000)
    line = run(tmp_path, tmp_path / "noise.wav")[-1]
    assert "no laugh found" in line
    with pytest.raises(InputError, match="write yes under 'kept'"):
        desired_laugh(tmp_path)
    (tmp_path / "calls.csv").write_text("start_s,end_s,kept\n0.5,0.7,yes\n0.7,0.9,yes\n")
    run(tmp_path, tmp_path / "noise.wav")
    calls = desired_laugh(tmp_path).calls
    assert [one.bout for one in calls] == [1, 1]
    assert all(one.start <= one.peak_time <= one.end for one in calls)


def test_a_part_keeps_the_time_of_the_file(data_samples: Path, tmp_path: Path) -> None:
    run(tmp_path, data_samples / "laugh2.flac", start_s="2.6", end_s="4.0")
    calls = desired_laugh(tmp_path).calls
    assert len(calls) == 5
    assert calls[0].peak_time == pytest.approx(2.83, abs=0.05)


def test_a_stage_of_another_kind_is_answered(data_samples: Path) -> None:
    assert "whose stages are audio, pressure, calls, follow" in job_of("fit", data_samples).problem


def test_settings_and_tables_belong_together() -> None:
    config = read_yaml(places.default_config())
    for name in ("audio", "pressure", "calls"):
        configuration.section(name, config[name], "test")
    with pytest.raises(InputError, match="linear or power"):
        configuration.section("pressure", {**config["pressure"], "map": "cubic"}, "test")


@pytest.mark.slow
def test_every_real_sound_ends_in_a_result_or_a_line(data_real: Path, tmp_path: Path) -> None:
    answered = set()
    for number, path in enumerate(sorted(data_real.rglob("*"))):
        if path.suffix not in SOUNDS:
            continue
        try:
            run(tmp_path / str(number), path)
        except TorsoError as error:
            assert "internal error" not in str(error)
            answered.add(path.name)
    assert answered == ANSWERED
