"""Make the synthetic laughs and the calibration set: `python scripts/make_laughs.py`.

Writes data_samples/laugh1 and laugh2 (FLAC, truth as CSV and JSON) and data_samples/calibration/
(three speakers: FLAC, measured pressure as CSV, the table calibration.tsv).
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path

import numpy as np
import soundfile

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from data_samples.laughs import (  # noqa: E402
    RATE,
    Laugh,
    Speaker,
    draw_laugh,
    draw_speaker,
    read_parameters,
)

EVERY = RATE // 200
SAMPLES = (("laugh1", "female", (6,), 11), ("laugh2", "male", (7, 5, 4), 12))
SPEAKERS = (("speaker1", "female", 21), ("speaker2", "male", 22), ("speaker3", "female", 23))
CALIBRATION_BOUTS = (6, 5, 4)


def write_sound(path: Path, sound: np.ndarray, loudness: float = 0.0) -> None:
    """Write FLAC of 16 bits; `loudness` in dB moves the level from its usual place."""
    level = 0.4 * 10 ** (loudness / 20) * sound / np.abs(sound).max()
    soundfile.write(path, np.clip(level, -1, 1), RATE, format="FLAC", subtype="PCM_16")


def write_curves(path: Path, laugh: Laugh, flow: bool) -> None:
    """Write pressure, and flow where it is known, at 200 Hz."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time_s", "pressure_cmh2o", *(["flow_l_s"] if flow else [])])
        for i in range(0, len(laugh.sound), EVERY):
            row = [f"{i / RATE:.3f}", f"{laugh.pressure[i]:.2f}"]
            writer.writerow([*row, *([f"{laugh.flow[i]:.3f}"] if flow else [])])


def truth(name: str, speaker: Speaker, laugh: Laugh) -> dict[str, object]:
    """What is known about a sample."""
    rows = zip(laugh.bout, laugh.starts, laugh.peaks, laugh.ends, strict=True)
    return {
        "recording": name,
        "sex": speaker.sex,
        "mean_peak_pressure_cmh2o": round(speaker.peak_pressure, 2),
        "gain_db_per_doubling": round(speaker.gain, 2),
        "reverberation_s": round(speaker.reverberation, 2),
        "expired_l": round(float(np.maximum(-laugh.flow, 0).sum() / RATE), 3),
        "calls": [
            {
                "bout": int(b),
                "start_s": round(float(s), 4),
                "peak_s": round(float(p), 4),
                "end_s": round(float(e), 4),
            }
            for b, s, p, e in rows
        ],
        "inhalations_s": [[round(a, 3), round(b, 3)] for a, b in laugh.inhalations],
    }


def main() -> None:
    """Write all files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "data_samples")
    out = parser.parse_args().out
    parameters = read_parameters()
    (out / "calibration").mkdir(parents=True, exist_ok=True)
    for name, sex, bouts, seed in SAMPLES:
        rng = np.random.default_rng(seed)
        speaker = draw_speaker(rng, sex, parameters)
        laugh = draw_laugh(rng, speaker, bouts, parameters)
        write_sound(out / f"{name}.flac", laugh.sound)
        write_curves(out / f"{name}.truth.csv", laugh, flow=True)
        text = json.dumps(truth(name, speaker, laugh), indent=1)
        (out / f"{name}.truth.json").write_text(text + "\n", encoding="utf-8")
    lines = ["subject\taudio\tpressure"]
    for name, sex, seed in SPEAKERS:
        rng = np.random.default_rng(seed)
        speaker = draw_speaker(rng, sex, parameters)
        laugh = draw_laugh(rng, speaker, CALIBRATION_BOUTS, parameters)
        write_sound(out / "calibration" / f"{name}.flac", laugh.sound, min(6.0, speaker.loudness))
        write_curves(out / "calibration" / f"{name}.csv", laugh, flow=False)
        lines.append(f"{name}\t{name}.flac\t{name}.csv")
    (out / "calibration" / "calibration.tsv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
