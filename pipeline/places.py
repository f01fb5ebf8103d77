"""Where the workflow, its defaults and its profiles are, in a clone and once installed."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from collections.abc import Sequence
from functools import cache
from importlib import metadata
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent


def _shipped(inside_wheel: str, inside_clone: str) -> Path:
    installed = PACKAGE / "shipped" / inside_wheel
    return installed if installed.exists() else PACKAGE.parent / inside_clone


def default_config() -> Path:
    """Return the file that holds every default setting."""
    return _shipped("config.yaml", "config/config.yaml")


def profiles() -> Path:
    """Return the folder of Snakemake profiles."""
    return _shipped("profiles", "profiles")


def workflow() -> Path:
    """Return the file that the Snakefiles of a clone and of a study include."""
    return PACKAGE / "rules" / "workflow.smk"


def version() -> str:
    """Return the version of the installed distribution."""
    try:
        return metadata.version("pleura")
    except metadata.PackageNotFoundError:
        return "not installed"


def fingerprint(root: Path, packages: Sequence[str] = ("sim", "pipeline")) -> str:
    """Return a short digest of the Python and data files of the packages under `root`."""
    digest = hashlib.sha256()
    for package in packages:
        for path in sorted((root / package).rglob("*")):
            inside = path.relative_to(root)
            if "__pycache__" in inside.parts or inside.parts[:2] == ("pipeline", "shipped"):
                continue
            if path.is_file() and not any(part.startswith(".") for part in inside.parts):
                digest.update(inside.as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


@cache
def stamp() -> str:
    """Return version and digest of the code, so that a page is made anew when either changes."""
    return f"{version()} {fingerprint(PACKAGE.parent)}"


@cache
def torso_code() -> str:
    """Return the digest of the simulation alone: a fit is made anew when its torso changes."""
    return fingerprint(PACKAGE.parent, ("sim",))


def commit(folder: Path) -> str:
    """Return the git commit of a clone, `+` when edited since; empty when it is not ours."""
    git = shutil.which("git")
    if git is None or not (folder / "pipeline" / "places.py").exists():
        return ""

    def ask(*words: str) -> str:
        answer = subprocess.run(
            [git, "-C", str(folder), *words], capture_output=True, text=True, check=False
        )
        return answer.stdout.strip()

    head = ask("rev-parse", "--short=12", "HEAD")
    edited = ask("status", "--porcelain", "--untracked-files=no", "--", "sim", "pipeline")
    return f"{head}+" if head and edited else head


def difference(folder: Path, installed: Path) -> str:
    """Return one line when `folder` is a clone whose code is not the installed one, else ''."""
    clone = folder / "pipeline" / "places.py"
    if not clone.exists() or installed.resolve() == folder.resolve():
        return ""
    if fingerprint(folder) == fingerprint(installed):
        return ""
    return (
        f"The installed pleura {version()} differs from the code in {folder}; the installed one"
        " runs. To run this one: pip install ."
    )
