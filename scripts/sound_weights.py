"""Fit the weights that tell laughter and kinds of sound: `sound_weights.py DATA_REAL SPEECH`.

DATA_REAL is the folder of real recordings, labelled by scripts/sound_labels.csv (what a recording
is, from its source, never from its sound). SPEECH is a folder of more speech, here synthetic (flite
and espeak-ng reading English and seven other languages), because the real recordings hold one
speech only; files are called VOICE_NUMBER.wav. Prints what is found for each recording when it is
left out, then writes pipeline/tables/laughter_weights.csv and sound_kinds.csv. Needs scikit-learn.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from pipeline.audio import read_sound  # noqa: E402
from pipeline.calls import call_envelope, find_calls  # noqa: E402
from pipeline.laughter import MEASURES, measure_bout  # noqa: E402
from pipeline.settings import AudioSettings, CallSettings  # noqa: E402
from pipeline.sound_kind import KINDS, kind_measures  # noqa: E402
from pipeline.sound_kind import MEASURES as KIND_MEASURES  # noqa: E402
from pipeline.voice import frame_measures  # noqa: E402

STRENGTH = 0.5
SOURCE = "fitted by scripts/sound_weights.py"
PLAIN = dict.fromkeys(KINDS)


def labelled(real: Path, speech: Path) -> list[tuple[Path, str, str]]:
    """File, kind, and the group that is left out together."""
    with (ROOT / "scripts" / "sound_labels.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    found = [
        (real / r["file"], r["kind"], r["file"])
        for r in rows
        if r["kind"] not in ("left out", "unreadable")
    ]
    more = sorted(speech.glob("*.wav"))
    return found + [(p, "speech", f"synthetic {p.stem.rsplit('_', 1)[0]}") for p in more]


def gather(files: list[tuple[Path, str, str]]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Measures of every bout and of every recording."""
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    audio, calls = AudioSettings(**config["audio"]), CallSettings(**config["calls"])
    bouts, whole = [], []
    for path, kind, group in files:
        sound = read_sound(path, audio)
        frames = frame_measures(sound.samples, sound.rate)
        found = find_calls(call_envelope(sound, calls), frames, calls)
        head = {"file": path.name, "kind": kind, "group": group}
        for number in np.unique(found.bout):
            peaks = found.peak[found.of_bout(int(number))]
            if len(peaks) >= 3:
                measures = measure_bout(peaks, frames)
                row = {name: getattr(measures, name) for name in MEASURES}
                bouts.append({**head, "start": peaks[0], "calls": len(peaks), **row})
        if kind in KINDS:
            whole.append({**head, **kind_measures(found, frames)})
    return pd.DataFrame(bouts), pd.DataFrame(whole)


def bout_weights(bouts: pd.DataFrame) -> np.ndarray:
    """Files count alike; laughter, speech and all else by 3, 1.5 and 1.5."""
    family = bouts["kind"].str.split(",").str[0]
    family = family.where(family.isin(["laugh", "speech"]), "other")
    weight = 1 / bouts.groupby("file")["file"].transform("size")
    weight = weight / weight.groupby(family).transform("sum") * len(bouts) / 3
    return (weight * np.where(family == "laugh", 1.5, 0.75)).to_numpy()


def model() -> Pipeline:
    """Scaled logistic regression."""
    return make_pipeline(StandardScaler(), LogisticRegression(C=STRENGTH, max_iter=1000))


def laughter(bouts: pd.DataFrame) -> None:
    """Fit laughter against the rest; print each bout's probability when its group is left out."""
    columns, is_laugh = list(MEASURES), bouts["kind"] == "laugh"
    left_out = np.full(len(bouts), np.nan)
    for group in bouts["group"].unique():
        out = (bouts["group"] == group).to_numpy()
        one = model()
        one.fit(bouts.loc[~out, columns], is_laugh[~out],
                logisticregression__sample_weight=bout_weights(bouts[~out]))  # fmt: skip
        left_out[out] = one.predict_proba(bouts.loc[out, columns])[:, 1]
    bouts = bouts.assign(left_out=left_out, right=(left_out > 0.5) == is_laugh)
    print(bouts[["file", "kind", "start", "calls", "left_out", "right"]].round(2).to_string())
    synthetic = bouts["group"].str.startswith("synthetic")
    print(bouts.groupby([bouts["kind"], synthetic])["right"].agg(["sum", "size"]))
    one = model()
    one.fit(bouts[columns], is_laugh, logisticregression__sample_weight=bout_weights(bouts))
    scale, fit = one[0], one[1]
    rows: list[list[object]] = [["intercept", 0, 1, f"{fit.intercept_[0]:.4f}", SOURCE]]
    values = zip(columns, scale.mean_, scale.scale_, fit.coef_[0], strict=True)
    rows += [[n, f"{m:.4f}", f"{s:.4f}", f"{w:.4f}", SOURCE] for n, m, s, w in values]
    write("laughter_weights.csv", ["measure", "mean", "sd", "weight", "source"], rows)


def kinds(whole: pd.DataFrame) -> None:
    """Fit the five kinds; print what each recording is called when its group is left out."""
    columns = list(KIND_MEASURES)
    called, confidence = [], []
    for i in range(len(whole)):
        out = whole["group"] == whole["group"].iloc[i]
        one = model()
        one[1].set_params(class_weight="balanced")
        one.fit(whole.loc[~out, columns], whole.loc[~out, "kind"])
        share = one.predict_proba(whole.loc[[whole.index[i]], columns])[0]
        called.append(one.classes_[share.argmax()])
        confidence.append(share.max())
    whole = whole.assign(called=called, confidence=confidence)
    real = whole[~whole["group"].str.startswith("synthetic")]
    print(pd.crosstab(real["kind"], real["called"]))
    right = real["kind"] == real["called"]
    print(real.loc[~right, ["file", "kind", "called", "confidence"]].round(2).to_string())
    bins = pd.cut(real["confidence"], [0, 0.6, 0.8, 1.0])
    print(right.groupby(bins, observed=True).agg(["mean", "size"]))
    one = model()
    one[1].set_params(class_weight="balanced")
    one.fit(whole[columns], whole["kind"])
    scale, fit = one[0], one[1]
    order = [list(fit.classes_).index(kind) for kind in KINDS]
    rows: list[list[object]] = [
        ["intercept", 0, 1, *(f"{fit.intercept_[i]:.4f}" for i in order), SOURCE]
    ]
    for j, name in enumerate(columns):
        weights = [f"{fit.coef_[i][j]:.4f}" for i in order]
        rows.append([name, f"{scale.mean_[j]:.4f}", f"{scale.scale_[j]:.4f}", *weights, SOURCE])
    write("sound_kinds.csv", ["measure", "mean", "sd", *KINDS, "source"], rows)


def write(name: str, header: list[str], rows: list[list[object]]) -> None:
    """Write a table of weights."""
    with (ROOT / "pipeline" / "tables" / name).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def main() -> None:
    """Fit and write both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("real", type=Path)
    parser.add_argument("speech", type=Path)
    options = parser.parse_args()
    bouts, whole = gather(labelled(options.real, options.speech))
    laughter(bouts)
    kinds(whole)


if __name__ == "__main__":
    main()
