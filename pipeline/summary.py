"""The first lines of a report: what was found, in plain words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pipeline.headline import BAD, GOOD, PLAIN
from pipeline.page import SUBJECT_MEAN, Rows, number, sentence, words
from pipeline.report_tables import interval_text, main_error, share_of_still

# Below this part of the largest level a group is said to be near rest.
NEAR_REST = 0.1


@dataclass(frozen=True, kw_only=True, slots=True)
class Summary:
    """The result and its mark, more sentences, and (value, label) pairs that stand out."""

    result: str
    mark: str
    sentences: tuple[str, ...]
    numbers: tuple[tuple[str, str], ...]


def _float(row: Mapping[str, str], key: str) -> float:
    try:
        return float(row.get(key, "nan"))
    except ValueError:
        return math.nan


def _breathing(signature: Mapping[str, Any]) -> tuple[list[str], list[tuple[str, str]]]:
    if signature["status"] != "ok":
        return [], []
    period = signature["inspiration_time_s"] + signature["expiration_time_s"]
    rate = 60 / period
    used, found = signature["n_used"], signature["n_cycles"]
    sentence = (
        f"The mean of {used} of {found} breaths lasts {number(period, 2)} s:"
        f" {number(signature['inspiration_time_s'], 2)} s in and"
        f" {number(signature['expiration_time_s'], 2)} s out, {number(rate, 2)} breaths a minute."
    )
    return [sentence], [(f"{number(rate, 2)} / min", "breathing rate")]


def _closeness(errors: Rows) -> tuple[str, str, list[tuple[str, str]]]:
    """Result, its mark and the figures of it."""
    row = main_error(errors)
    if not row:
        return "", PLAIN, []
    error, still, share = _float(row, "error_p_mm"), row["error_p_still_mm"], share_of_still(row)
    if not math.isfinite(share):
        return "The markers do not move, so the fit says nothing.", BAD, []
    if share >= 1:
        text = (
            f"The torso follows this breath no better than standing still would:"
            f" {number(error, 2)} mm against {number(still, 2)} mm."
        )
    else:
        text = (
            f"Over these breaths the simulated markers are {number(error, 2)} mm from the measured"
            f" ones on average; a torso that does not move would miss them by"
            f" {number(still, 2)} mm."
        )
    spread = _float(row, "spread_mm")
    if math.isfinite(spread):
        text += f" The subject's other breaths are {number(spread, 2)} mm from each one."
    # as near as the breaths are to each other is all that one breath for all can be
    mark = BAD if share >= 1 else GOOD if error <= spread else PLAIN
    return (
        text,
        mark,
        [
            (f"{number(error, 2)} mm", "mean error of the markers"),
            (number(share, 2), "of the error of not moving"),
        ],
    )


def _levels(activations: Rows) -> list[str]:
    mean = [row for row in activations if row.get("scope") == SUBJECT_MEAN]
    known = {row["group"]: row for row in mean if math.isfinite(_float(row, "level"))}
    if not known:
        return []
    largest = max(_float(row, "level") for row in known.values())
    said = "; ".join(f"{words(group)} {interval_text(row)}" for group, row in known.items())
    resting = [
        words(g) for g, row in known.items() if _float(row, "high") < max(NEAR_REST * largest, 0.01)
    ]
    percent = 100 * _float(next(iter(known.values())), "probability")
    text = (
        "How strongly each muscle group works at the height of a breath, from 0 (rest) to 1 (all"
        " it has)"
    )
    if math.isfinite(percent):
        text += f", with the range that holds it with {number(percent, 2)} % probability"
    else:
        text += ", without intervals (see the section on activations)"
    text += f": {said}."
    if resting:
        text += f" Near rest: {', '.join(resting)}."
    return [text]


def summarise(
    records: Mapping[str, Mapping[str, Any]], errors: Rows, activations: Rows, problem: str
) -> Summary:
    """Say what was found.

    Parameters
    ----------
    records : stage to its JSON
    errors, activations : rows of errors.csv and activations.csv
    problem : why the recording could not be used, empty if it could
    """
    result, mark, numbers = _closeness(errors)
    if problem:
        result, mark = f"This recording could not be used to the end: {problem}", BAD
    sentences, more = _breathing(records["signature"])
    numbers += more
    if "tidal_volume_l" in records["fit"]:
        numbers.append(
            (f"{number(records['fit']['tidal_volume_l'], 2)} L", "breathed by the model")
        )
    sentences += _levels(activations)
    sentences += [sentence(line) for line in records["posterior"].get("identifiability", [])]
    return Summary(
        result=result or "The recording was read; no torso has been fitted to it.",
        mark=mark,
        sentences=tuple(sentences),
        numbers=tuple(numbers),
    )
