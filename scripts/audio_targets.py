"""Measure what the sound stages reach: `python scripts/audio_targets.py DATA_REAL`.

Peaks against the annotated recordings, what is called laughter in every real file, and pressure
recovered for fifty synthetic speakers. Prints; changes nothing.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from data_samples import laughs  # noqa: E402
from pipeline.audio import Sound, read_sound  # noqa: E402
from pipeline.calls import Candidates, call_envelope, find_calls  # noqa: E402
from pipeline.envelope import RATE  # noqa: E402
from pipeline.laughter import Verdict, judge  # noqa: E402
from pipeline.pressure import PressureCurve, loudness, pressure_curve  # noqa: E402
from pipeline.pressure_map import CalibratedSubject, assumed_map, fit_map  # noqa: E402
from pipeline.settings import AudioSettings, CallSettings, PressureSettings  # noqa: E402
from pipeline.sound_calibration import normalised_subject, read_calibration  # noqa: E402
from pipeline.sound_kind import kind_measures, tell_kind  # noqa: E402
from pipeline.voice import Frames, frame_measures  # noqa: E402
from sim.errors import InputError  # noqa: E402
from sim.units import PASCAL_PER_CMH2O  # noqa: E402

TOLERANCE = 0.05
BOUTS = (6, 5, 4)
SOUNDS = {".wav", ".flac", ".ogg", ".mp3"}


def settings() -> tuple[AudioSettings, PressureSettings, CallSettings]:
    """Shipped settings of the three stages."""
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    return (
        AudioSettings(**config["audio"]),
        PressureSettings(**config["pressure"]),
        CallSettings(**config["calls"]),
    )


def hits(found: np.ndarray, marked: np.ndarray) -> tuple[int, int, int]:
    """Peaks found and marked (each at most once), marked, found."""
    free, count = list(found), 0
    for peak in marked:
        near = [one for one in free if abs(one - peak) <= TOLERANCE]
        if near:
            free.remove(min(near, key=lambda one: abs(one - peak)))
            count += 1
    return count, len(marked), len(found)


def f1(counts: tuple[int, int, int]) -> float:
    """Harmonic mean of the shares found and right."""
    return 2 * counts[0] / max(1, counts[1] + counts[2])


def analyse(path: Path) -> tuple[Candidates, list[Verdict], Frames]:
    """Run a file to its verdicts."""
    audio, _, calls = settings()
    sound = read_sound(path, audio)
    frames = frame_measures(sound.samples, sound.rate)
    found = find_calls(call_envelope(sound, calls), frames, calls)
    return found, judge(found, frames, calls), frames


def kept(found: Candidates, verdicts: list[Verdict]) -> np.ndarray:
    """Which calls are laughter."""
    return np.isin(found.bout, [one.bout for one in verdicts if one.laughter])


def real_files(real: Path) -> None:
    """Print what every real file ends in."""
    total = np.zeros(3, dtype=int)
    for path in sorted(p for p in real.rglob("*") if p.suffix in SOUNDS):
        try:
            found, verdicts, frames = analyse(path)
        except InputError as error:
            print(f"{path.name}: {str(error).split(': ', 1)[1]}")
            continue
        good = kept(found, verdicts)
        kind = tell_kind(kind_measures(found, frames))
        bouts = sum(one.laughter for one in verdicts)
        line = (
            f"{path.name}: {good.sum()} of {len(good)} peaks kept in {bouts} bouts; {kind.sentence}"
        )
        marked_file = path.with_name(path.name.split(".")[0] + ".calls.csv")
        if marked_file.exists():
            marked = pd.read_csv(marked_file)
            voiced = marked.loc[marked["kind"] == "voiced", "peak_s"].to_numpy()
            counts = hits(found.peak[good & found.voiced], voiced)
            total += counts
            line += f"; voiced peaks {counts}, F1 {f1(counts):.3f}"
        print(line)
    print(f"all annotated recordings: {tuple(total.tolist())}, F1 {f1(tuple(total)):.3f}")


@dataclass(frozen=True, kw_only=True, slots=True)
class Person:
    """A synthetic speaker: sound, true pressure (Pa at RATE), both as calibration sees them."""

    sex: str
    sound: Sound
    pressure: np.ndarray
    calibrated: CalibratedSubject


def speakers(count: int, seed: int, **changed: float) -> list[Person]:
    """Draw speakers; `changed` replaces parameters of the samples."""
    _, pressure, _ = settings()
    parameters = {**laughs.read_parameters(), **changed}
    out = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        sex = ("female", "male")[number % 2]
        speaker = laughs.draw_speaker(rng, sex, parameters)
        laugh = laughs.draw_laugh(rng, speaker, BOUTS, parameters)
        samples = laugh.sound / np.abs(laugh.sound).max()
        sound = Sound(
            source=str(number),
            rate=float(laughs.RATE),
            start=0.0,
            samples=samples,
            rectified=np.abs(samples),
            quality={},
            warnings=(),
        )
        level, there = loudness(sound, pressure, stronger=False)
        at = np.arange(len(level)) / RATE
        true = PASCAL_PER_CMH2O * np.interp(
            at, np.arange(len(laugh.pressure)) / laughs.RATE, laugh.pressure
        )
        subject = normalised_subject(str(number), level, there >= 0.5, true, pressure)
        out.append(Person(sex=sex, sound=sound, pressure=true, calibrated=subject))
    return out


def recovery(people: list[Person], form: str, n_calibrated: int, seed: int = 0) -> dict[str, float]:
    """Means over people of coverage and r, each predicted from others drawn at random.

    Parameters
    ----------
    people : of `speakers`
    form : linear or power
    n_calibrated : others whose pressure was measured; 0: none
    """
    _, pressure, _ = settings()
    rng = np.random.default_rng(seed)
    rows = []
    for number, one in enumerate(people):
        others = [k for k in range(len(people)) if k != number]
        drawn = rng.choice(others, n_calibrated, replace=False)
        shape = assumed_map(form, one.sex)
        if n_calibrated:
            shape = fit_map([people[k].calibrated for k in drawn], form)
        rows.append(compare(one, pressure_curve(one.sound, shape, pressure)))
    return dict(pd.DataFrame(rows).mean())


def compare(one: Person, curve: PressureCurve) -> dict[str, float]:
    """Coverage and r of one prediction."""
    inside = (one.pressure >= curve.low) & (one.pressure <= curve.high)
    there = curve.active
    return {
        "coverage": float(inside.mean()),
        "coverage in bouts": float(inside[there].mean()),
        "r": float(np.corrcoef(curve.pressure, one.pressure)[0, 1]),
        "r in bouts": float(
            np.corrcoef(curve.pressure[there], one.calibrated.filtered[there])[0, 1]
        ),
    }


def shipped(people: list[Person], form: str) -> dict[str, float]:
    """The same from the three calibration recordings of data_samples."""
    audio, pressure, _ = settings()
    table = ROOT / "data_samples" / "calibration" / "calibration.tsv"
    shape = fit_map(read_calibration(table, audio, pressure, stronger=False), form)
    rows = [compare(one, pressure_curve(one.sound, shape, pressure)) for one in people]
    return dict(pd.DataFrame(rows).mean())


def show(label: str, figures: dict[str, float]) -> None:
    """Print a line of figures."""
    print(label, ", ".join(f"{key} {value:.3f}" for key, value in figures.items()))


def main() -> None:
    """Print everything."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("real", type=Path)
    real_files(parser.parse_args().real)
    people = speakers(50, seed=1)
    for form in ("linear", "power"):
        for count in (0, 1, 3, 10, 49):
            show(f"{form}, calibrated on {count} others:", recovery(people, form, count))
        show(f"{form}, calibrated on the three shipped:", shipped(people, form))
    for spread in (0.2, 0.5):
        people = speakers(50, seed=2, peak_pressure_log_sd=spread)
        show(f"linear, 10 others, true spread {spread}:", recovery(people, "linear", 10))


if __name__ == "__main__":
    main()
