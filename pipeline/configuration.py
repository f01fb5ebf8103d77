"""The configuration: shipped defaults, a study's changes on top, every key and value checked."""

from __future__ import annotations

import copy
import dataclasses
import difflib
import types
import typing
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from pipeline import places
from pipeline.settings import (
    AudioSettings,
    CallSettings,
    FitSettings,
    FollowSettings,
    MarkerSettings,
    PapersSettings,
    PosteriorSettings,
    PressureSettings,
    RetrainingSettings,
    SignatureSettings,
)
from sim.errors import InputError

SECTIONS: dict[str, type] = {
    "markers": MarkerSettings,
    "signature": SignatureSettings,
    "fit": FitSettings,
    "posterior": PosteriorSettings,
    "audio": AudioSettings,
    "pressure": PressureSettings,
    "calls": CallSettings,
    "follow": FollowSettings,
    "papers": PapersSettings,
    "retraining": RetrainingSettings,
}
STUDY_FILE = Path("config/config.yaml")
TABLES = ("recordings", "subjects")


def nearest_words(word: str, known: Iterable[str], count: int = 3) -> list[str]:
    """Return the known words that look like `word`, the nearest first."""
    return difflib.get_close_matches(word, list(known), n=count, cutoff=0.6)


def nearest(word: str, known: Iterable[str], count: int = 3) -> str:
    """Return ' Did you mean a or b?' with the known words nearest to `word`, or ''."""
    close = nearest_words(word, known, count)
    return f" Did you mean {' or '.join(close)}?" if close else ""


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML mapping; an empty file is an empty mapping."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        place = " ".join(str(error).split())
        raise InputError(f"{path}: is not YAML: {place}. Mend the line it names.") from error
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise InputError(f"{path}: holds no 'key: value' lines. See config/README.md.")
    return content


def merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Lay `changes` over `base`, section by section."""
    merged = copy.deepcopy(dict(base))
    for key, value in changes.items():
        if isinstance(value, Mapping) and isinstance(merged.get(key), Mapping):
            merged[key] = merge(merged[key], value)
        else:
            merged[key] = value
    return merged


def _fits(value: Any, kind: Any) -> bool:
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        return any(_fits(value, k) for k in typing.get_args(kind))
    if origin is tuple:
        inner = typing.get_args(kind)
        if not isinstance(value, list | tuple):
            return False
        if len(inner) == 2 and inner[1] is ...:
            return all(_fits(v, inner[0]) for v in value)
        return len(inner) == len(value) and all(map(_fits, value, inner))
    if origin is not None:
        return isinstance(value, origin)
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool)
    return kind is Any or isinstance(value, kind)


def _plain_name(kind: Any) -> str:
    words = {float: "a number", int: "a whole number", str: "a word", bool: "true or false"}
    return words.get(kind, f"of type {str(kind).replace('types.', '')}")


def section(name: str, values: Mapping[str, Any], source: str) -> Any:
    """Build the settings dataclass of a stage; name the key that is wrong or missing."""
    kind = SECTIONS[name]
    hints = typing.get_type_hints(kind)
    if not isinstance(values, Mapping):
        raise InputError(f"{source}: {name}: must hold 'key: value' lines, not {values!r}.")
    for key in values:
        if key not in hints:
            raise InputError(f"{source}: {name}.{key}: is not a setting.{nearest(str(key), hints)}")
    built = {}
    for field in dataclasses.fields(kind):
        if field.name not in values:
            raise InputError(f"{source}: {name}.{field.name}: is missing. Give it a value.")
        value, wanted = values[field.name], hints[field.name]
        if not _fits(value, wanted):
            raise InputError(
                f"{source}: {name}.{field.name}: is {value!r}, must be {_plain_name(wanted)}."
            )
        built[field.name] = tuple(value) if isinstance(value, list) else value
    try:
        return kind(**built)
    except ValueError as error:
        raise InputError(f"{source}: {name}: {error}") from error


def check(config: Mapping[str, Any], source: str) -> None:
    """Refuse an unknown key, a missing one, or a value of the wrong kind.

    Parameters
    ----------
    config : the merged configuration
    source : the file to name in a complaint
    """
    known = {"seed", *SECTIONS, *TABLES}
    for key in config:
        if key not in known:
            raise InputError(f"{source}: {key}: is not a setting.{nearest(str(key), known)}")
    for name in SECTIONS:
        section(name, config.get(name, {}), source)
    if not _fits(config.get("seed"), int) or config["seed"] < 0:
        raise InputError(f"{source}: seed: is {config.get('seed')!r}, must be a whole number.")
    for table in TABLES:
        if not isinstance(config.get(table), str):
            raise InputError(f"{source}: {table}: must be the path of a table.")


def load(study_file: Path | None, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Read the defaults, lay a study's file and the command line over them, check the result.

    Parameters
    ----------
    study_file : a study's own configuration; None or absent: defaults alone
    overrides : keys given on the command line
    """
    config = read_yaml(places.default_config())
    source = str(places.default_config())
    if study_file is not None and study_file.exists():
        config = merge(config, read_yaml(study_file))
        source = str(study_file)
    config = merge(config, overrides)
    check(config, source)
    return config
