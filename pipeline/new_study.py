"""The folder of a study of one's own."""

from __future__ import annotations

import shutil
from pathlib import Path

from pipeline import places
from pipeline.configuration import read_yaml
from pipeline.records import write_text
from pipeline.study import SCHEMAS
from sim.errors import InputError

SNAKEFILE = """\
# The workflow of the installed pleura, on the tables in config/.
from pipeline import places


include: str(places.workflow())


rule all:
    input:
        plan.everything,
"""

CONFIG = """\
# Only what differs from the defaults of pleura; `pleura check` knows every key. For example:
# seed: 7
# fit:
#   n_evaluations: 200
"""

README = """\
# {name}

1. Put recordings (C3D, or CSV/TSV with a time column; sounds of laughter) into `data/`.
2. One row a person in `config/subjects.tsv`: `sex` female or male, `stature_m` in metres and
   `mass_kg` in kilograms (both may be empty: a population value is used and said so), `posture`
   upright or supine.
3. One row a recording in `config/recordings.tsv`: `kind` is breath or laugh, `path` starts at the
   folder of the table (`../data/first.c3d`); `start_s` and `end_s` cut it, `markers` names a file
   that maps labels, or a laugh's calibration table; these three may be empty.
4. `pleura check`, then `snakemake reports/NAME.html` for one row or `snakemake` for all, with the
   pages `reports/error_table.html` and `reports/group.html`.

After a power cut or a kill: `snakemake --unlock`, then the same command again.
"""


def create(folder: Path) -> None:
    """Make the folder of a study: tables, configuration, Snakefile and profiles.

    Parameters
    ----------
    folder : must not exist, or be empty
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: is there already. Choose a new name; nothing was written.")
    try:
        (folder / "data").mkdir(parents=True)
        for table in ("recordings", "subjects"):
            columns = "\t".join(read_yaml(SCHEMAS / f"{table}.yaml"))
            write_text(folder / "config" / f"{table}.tsv", f"{columns}\n")
        write_text(folder / "config" / "config.yaml", CONFIG)
        write_text(folder / "Snakefile", SNAKEFILE)
        write_text(folder / "README.md", README.format(name=folder.resolve().name))
        shutil.copytree(places.profiles(), folder / "profiles")
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}).") from error
