"""Stage results on disk: written whole or not at all."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sim.errors import InputError

Record = TypeVar("Record")


def write_bytes(path: Path, content: bytes) -> None:
    """Write under a temporary name, then rename, so that no half file is ever seen."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """`write_bytes` in UTF-8."""
    write_bytes(path, text.encode("utf-8"))


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    raise TypeError(f"cannot write {type(value).__name__} as JSON")


def write_json(path: Path, content: object) -> None:
    """Write `content` as indented JSON; not-a-number becomes null."""

    def clean(value: Any) -> Any:
        if isinstance(value, dict):
            return {str(k): clean(v) for k, v in value.items()}
        if isinstance(value, list | tuple):
            return [clean(v) for v in value]
        if isinstance(value, float | np.floating) and not np.isfinite(value):
            return None
        if isinstance(value, np.ndarray):
            return clean(value.tolist())
        return value

    plain = json.loads(json.dumps(clean(content), default=_plain).replace("NaN", "null"))
    write_text(path, json.dumps(plain, indent=1, ensure_ascii=False) + "\n")


def read_json(path: Path) -> Any:
    """Read a JSON file; a damaged one is an `InputError`."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({error}). Delete it and run again.") from error


def seconds_or_none(text: str) -> float | None:
    """Read a cell of seconds; an empty one is None."""
    return float(text) if text else None


def _cell(value: Any) -> Any:
    """Return what a table shows: nothing for not-a-number."""
    return "" if isinstance(value, float) and not np.isfinite(value) else value


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows of the same columns as CSV."""
    stream = io.StringIO()
    if rows:
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: _cell(value) for key, value in row.items()} for row in rows)
    write_text(path, stream.getvalue())


def save(record: Any, path: Path) -> None:
    """Save a dataclass of arrays, numbers, strings, tuples and dicts as one `.npz`."""
    arrays: dict[str, np.ndarray] = {}
    rest: dict[str, Any] = {}
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray):
            arrays[field.name] = value
        else:
            rest[field.name] = value
    arrays["json"] = np.array(json.dumps(rest, default=_plain))
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    write_bytes(path, buffer.getvalue())


def load(kind: type[Record], path: Path) -> Record:
    """Load what `save` wrote; lists come back as tuples."""

    def tuples(value: Any) -> Any:
        return tuple(tuples(v) for v in value) if isinstance(value, list) else value

    try:
        with np.load(path, allow_pickle=False) as archive:
            values: dict[str, Any] = {k: archive[k] for k in archive.files if k != "json"}
            rest = json.loads(str(archive["json"]))
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{path}: cannot be read ({error}). Delete it and run again.") from error
    values.update({k: tuples(v) for k, v in rest.items()})
    return kind(**values)
