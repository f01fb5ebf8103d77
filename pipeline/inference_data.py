"""The only door to ArviZ: a posterior as InferenceData in a NetCDF file."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.uncertainty import Posterior

with warnings.catch_warnings():
    # said once a day at import: that its next version is another package
    warnings.filterwarnings("ignore", message=r"\s*ArviZ is undergoing", category=FutureWarning)
    import arviz


def to_inference_data(posterior: Posterior) -> Any:
    """Make groups `posterior` and `posterior_predictive` (next breath), figures as attributes."""
    dims = {name: ["group"] for name in ("level", "level_without_discrepancy", "next_breath_level")}
    data = arviz.from_dict(
        posterior={
            "level": posterior.draws,
            "discrepancy_m": posterior.discrepancy,
            "level_without_discrepancy": posterior.draws_without,
        },
        posterior_predictive={"next_breath_level": posterior.next_breath},
        coords={"group": list(posterior.groups)},
        dims=dims,
    )
    data.posterior.attrs.update(
        {
            "recording": posterior.name,
            "status": posterior.status,
            "why": posterior.why,
            "convergence": posterior.convergence,
            "converged": int(posterior.converged),
            "emulator_share": posterior.emulator_share,
            "n_effective": posterior.n_effective,
            "noise_m": posterior.noise,
            "seed": posterior.seed,
        }
    )
    return data


def write_netcdf(posterior: Posterior, path: Path) -> None:
    """Write the draws; the chain dimension counts independent ensembles.

    A posterior without intervals has no draws: the file then holds the attributes alone.
    """
    temporary = path.with_name(f".{path.name}.part")
    try:
        if posterior.draws.size:
            to_inference_data(posterior).to_netcdf(str(temporary), engine="h5netcdf")
        else:
            import xarray

            empty = xarray.Dataset(attrs={"status": posterior.status, "why": posterior.why})
            empty.to_netcdf(temporary, engine="h5netcdf", group="posterior")
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def read_draws(path: Path) -> np.ndarray[Any, Any]:
    """Levels (n_ensembles, n_draws, 4) of a file that `write_netcdf` wrote."""
    return np.asarray(arviz.from_netcdf(str(path)).posterior["level"].values)
