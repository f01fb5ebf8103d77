"""The stage `follow`: which primitives, what is refused, its columns, its page; then the whole."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest

from pipeline import calls_file, configuration, records, status
from pipeline.audio import Sound
from pipeline.configuration import load
from pipeline.draw.follow import followed_svg, search_svg
from pipeline.follow_stage import follow
from pipeline.followed import Followed
from pipeline.job import CHAINS, LAUGH, Job, make_job
from pipeline.laugh_report import write_laugh_report
from pipeline.laugh_scene import encoded, padded
from pipeline.run import run_stage
from pipeline.stages import STAGES
from pipeline.study import Entry
from sim.errors import InputError, TorsoError

SUBJECT = {"subject": "p1", "sex": "male", "stature_m": "1.756", "mass_kg": "75"}


def job_of(stage: str, file: Path, changes: dict[str, Any] | None = None) -> Job:
    row = {"recording": "one", "kind": LAUGH, "subject": "p1", "start_s": "", "end_s": ""}
    entry = Entry(
        name="one", recording=row, subject={**SUBJECT, "posture": "upright"}, file=file,
        markers=None, problem="", reportable=True,
    )  # fmt: skip
    return make_job(entry, stage, load(None, {"follow": changes or {}}))


def heard(file: Path, folder: Path) -> None:
    for stage in CHAINS[LAUGH][:3]:
        run_stage(STAGES[stage], job_of(stage, file), folder, 1)


@pytest.fixture(scope="module")
def laugh(tmp_path_factory: pytest.TempPathFactory, data_samples: Path) -> Path:
    folder = tmp_path_factory.mktemp("one")
    heard(data_samples / "laugh1.flac", folder)
    return folder


def test_a_long_sound_names_the_remedy(laugh: Path, data_samples: Path) -> None:
    job = job_of("follow", data_samples / "laugh1.flac", {"max_duration_s": 1.0})
    with pytest.raises(InputError, match="Name a part of it by start_s and end_s"):
        follow(job, laugh, 1)


def test_noise_is_nothing_to_follow(tmp_path: Path) -> None:
    import soundfile

    rng = np.random.default_rng(5)
    file = tmp_path / "talk.wav"
    soundfile.write(file, rng.normal(0, 0.1, 32000), 16000)
    heard(file, tmp_path / "one")
    audio = records.read_json(tmp_path / "one" / "audio.json")
    records.write_json(tmp_path / "one" / "audio.json", {**audio, "kind": "speech"})
    with pytest.raises(TorsoError, match="nothing for a torso to follow"):
        run_stage(STAGES["follow"], job_of("follow", file), tmp_path / "one", 1)
    page = write_laugh_report(tmp_path / "one", tmp_path / "page.html").read_text()
    assert "nothing for a torso to follow" in page
    assert not (tmp_path / "one" / "control.xml").exists()


def test_columns_of_the_fit_are_no_edit(laugh: Path, tmp_path: Path) -> None:
    for name in ("calls.csv", "calls.found.csv"):
        (tmp_path / name).write_bytes((laugh / name).read_bytes())
    table = tmp_path / "calls.csv"
    calls_file.add_columns(table, {2: {"rms_normalised": "0.1", "evaluations": "100"}})
    assert not calls_file.is_edited(tmp_path)
    rows = pd.read_csv(table)
    assert rows["evaluations"].notna().tolist() == [False, True, False, False, False, False]
    table.write_text(table.read_text().replace("yes,yes,", "yes,no,", 1))
    digest = calls_file.edit_digest(tmp_path)
    assert digest
    calls_file.add_columns(table, {1: {"rms_normalised": "0.2"}})
    assert calls_file.edit_digest(tmp_path) == digest


def a_followed(asked: np.ndarray) -> Followed:
    time = np.arange(0.0, 1.0, 0.004)
    wave = 1000.0 * np.sin(np.pi * time) ** 2
    return Followed(
        time=time, desired=wave, low=wave, high=wave, asked=asked, quantity="pressure",
        pressure=0.9 * wave, pleural=wave, abdominal=wave, flow=1e-4 * wave, lung=3e-3 + 0 * wave,
        levels=np.tile(wave[:, None] / 2000.0, (1, 4)), larynx=np.full(len(time), 30.0),
        rest=3e-3, start=0.0, end=1.0,
    )  # fmt: skip


def test_correlation_counts_where_it_is_asked_for() -> None:
    everywhere = a_followed(np.ones(250, dtype=bool))
    assert everywhere.correlation() == pytest.approx(1.0)
    assert np.isnan(a_followed(np.zeros(250, dtype=bool)).correlation())


def test_a_long_sound_gets_a_lower_rate_until_it_is_small_enough() -> None:
    noise = np.random.default_rng(1).normal(size=32000) * 0.1
    whole, rate = encoded(noise, 16000.0, 10_000_000)
    small, lower = encoded(noise, 16000.0, len(whole) // 2 + 2000)
    assert (rate, lower) == (16000, 8000)
    assert len(small) < 0.6 * len(whole)


def test_the_sound_of_a_page_lies_where_its_file_has_it() -> None:
    sound = Sound(
        source="a", rate=100.0, start=1.0, samples=np.ones(200), rectified=np.ones(200),
        quality={}, warnings=(),
    )  # fmt: skip
    out = padded(sound, (0.5, 4.0))
    assert len(out) == 350
    assert np.flatnonzero(out).tolist() == list(range(50, 250))
    assert out.max() == pytest.approx(0.9)


def test_the_page_plays_the_sound_and_asks_no_network(laugh: Path, data_samples: Path) -> None:
    one = a_followed(np.ones(250, dtype=bool))
    larynx = np.where(one.time < 0.3, np.inf, one.larynx)
    drawing = followed_svg(
        time=one.time, desired=one.desired, simulated=one.pressure, low=one.low, high=one.high,
        what="lung pressure", unit="cmH2O", volume=one.lung, levels=one.levels,
        groups=("a", "b", "c", "d"), larynx=larynx, spans=[(0.1, 0.4)], breaths=[(0.5, 0.8)],
        limits=(0.0, 1.0),
    )  # fmt: skip
    records.write_text(laugh / "followed.svg", drawing)
    trace = np.linspace(1.0, 0.1, 40)
    records.write_text(laugh / "search.svg", search_svg(traces={"as fitted": trace}))
    content = {
        "summary": "laugh followed", "kind": "laugh", "quantity": "pressure", "correlation": 0.97,
        "median_rms_normalised": 0.05, "air_used_by_bouts_l": [0.4], "evaluations": 300,
        "least_volume_below_rest_l": 0.4, "control_starts_at_s": 0.0, "control_ends_at_s": 2.0,
    }  # fmt: skip
    status.write_ok(
        laugh / "follow.json", job_of("follow", data_samples / "laugh1.flac"), content, 1.0
    )
    page = write_laugh_report(laugh, laugh / "page.html").read_text()
    assert page.count("data:audio/flac;base64,") == 1
    assert page.count("<script") == page.count("</script") == 2
    assert re.search(r"script-src( 'sha256-[A-Za-z0-9+/=]{44}'){2}", page)
    assert page.count("<svg data-time-axes=") == 3
    assert not re.search(r"""(src|href)=["']?https?:""", page)
    assert len(page) < 8_000_000


@pytest.mark.parametrize(
    ("key", "value", "word"),
    [("kind", "hiccup", "laugh, cough"), ("lung", "iron", "two_way"), ("strength", 0.0, "over 0"),
     ("n_evaluations", 0, "1 or more"), ("step_s", 0.1, "step_s"), ("goal", -1.0, "goal")],
)  # fmt: skip
def test_settings_that_cannot_be_are_refused(key: str, value: object, word: str) -> None:
    values = {**load(None, {})["follow"], key: value}
    with pytest.raises(InputError, match=word):
        configuration.section("follow", values, "test")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["laugh1", "laugh2"])
def test_a_synthetic_laugh_is_followed(name: str, data_samples: Path, tmp_path: Path) -> None:
    from sim.behaviour import run_controls
    from sim.control.reader import read_controls
    from sim.model.torso import Subject
    from sim.resting import rest_torso

    file = data_samples / f"{name}.flac"
    heard(file, tmp_path)
    run_stage(STAGES["follow"], job_of("follow", file, {"compared": []}), tmp_path, 2)
    found = status.read_status(tmp_path, "follow")
    assert found["correlation"] >= 0.9
    rows = pd.read_csv(tmp_path / "calls.csv").query("kept == 'yes'")
    assert rows["rms_normalised"].median() <= 0.16
    assert (rows["evaluations"] <= 200).all()
    assert found["least_volume_below_rest_l"] < 1.55
    truth = records.read_json(data_samples / f"{name}.truth.json")
    used = sum(found["air_used_by_bouts_l"])
    assert used == pytest.approx(truth["expired_l"], rel=0.6)
    # `pleura simulate control.xml` does the same again
    controls = read_controls(tmp_path / "control.xml")
    resting = rest_torso(Subject(sex="male", stature=1.756, mass=75.0))
    again = run_controls(resting, controls, posture="upright", duration=controls.duration or 0.0)
    with h5py.File(tmp_path / "trajectory.h5") as kept:
        assert np.array_equal(kept["pressures/lung"][:], again.trajectory.alveolar)
        steps = np.linalg.norm(np.diff(kept["bodies/position"][:], axis=0), axis=2)
    assert steps.max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["cough", "sneeze", "breath"])
def test_other_sounds_are_followed(kind: str, tmp_path: Path) -> None:
    import soundfile

    rng, time = np.random.default_rng(2), np.arange(24000) / 16000
    length = 0.9 if kind == "breath" else 0.3
    level = 1e-3 + np.clip(np.sin(np.pi * (time - 0.4) / length), 0, 1) * (time < 0.4 + length)
    level *= time > 0.4 - 1e-9
    soundfile.write(tmp_path / "one.wav", level * rng.normal(0, 0.1, len(time)) + 1e-6, 16000)
    heard(tmp_path / "one.wav", tmp_path)
    job = job_of("follow", tmp_path / "one.wav", {"kind": kind, "n_evaluations": 40})
    run_stage(STAGES["follow"], job, tmp_path, 2)
    found = status.read_status(tmp_path, "follow")
    assert found["kind"] == kind and found["correlation"] > 0.5
    if kind != "breath":
        assert found["most_volume_above_rest_l"] > 1.0
        assert found["highest_flow_l_s"] > 3.0


@pytest.mark.slow
@pytest.mark.minutes
def test_every_real_sound_ends_in_a_page_or_a_line(
    data_real: Path, tmp_path: Path, follow_real: ModuleType
) -> None:
    changes = {"n_evaluations": 8, "linear_steps": 1, "compared": []}
    config = load(None, {"follow": changes})
    for row in follow_real.follow_all(data_real, tmp_path, config, 2):
        assert "internal error" not in row["line"], row
        assert row["kind"] or row["line"].endswith("."), row
