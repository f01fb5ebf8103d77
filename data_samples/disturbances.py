"""What a laboratory adds to a breath: sway, skin, noise, drift, gaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from data_samples.parameters import Parameters
from data_samples.trunk import Floats


def band_noise(
    p: Parameters, rng: np.random.Generator, shape: tuple[int, ...], *, band: str
) -> Floats:
    """Noise of unit SD along the first axis, kept to the band that `band`_low/_high name."""
    sections = butter(
        2, [p(f"{band}_low"), p(f"{band}_high")], btype="band", fs=p("rate"), output="sos"
    )
    # Filtered over three times the length, so that the ends carry no start-up transient.
    count = shape[0]
    raw = sosfiltfilt(sections, rng.standard_normal((3 * count, *shape[1:])), axis=0)
    kept: Floats = raw[count : 2 * count] / raw.std(axis=0)
    return kept


def sway(p: Parameters, rng: np.random.Generator, tidal: Floats) -> tuple[Rotation, Floats]:
    """Rigid motion of the trunk about the hips: rotation and shift (n_frames, 3) m.

    `tidal` (n_frames,) is lung volume over the usual tidal volume; the trunk follows it a little.
    """
    noise = band_noise(p, rng, (len(tidal), 6), band="sway")
    angles = noise[:, :3] * [p("sway_roll"), p("sway_pitch"), p("sway_yaw")]
    shift = noise[:, 3:] * [p("sway_ap"), p("sway_ml"), p("sway_up")]
    angles[:, 1] += p("breath_pitch") * tidal
    shift[:, 0] += p("breath_shift") * tidal
    return Rotation.from_rotvec(angles), shift


def skin_and_noise(p: Parameters, rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Marker motion that is neither breath nor trunk, (n_frames, n_markers, 3) m."""
    wobble = p("skin_wobble") * band_noise(p, rng, shape, band="skin_wobble")
    white = p("marker_noise") * rng.standard_normal(shape)
    ramp = np.linspace(-0.5, 0.5, shape[0])[:, None, None]
    drift = p("marker_drift") * ramp * rng.standard_normal(shape[1:])
    result: Floats = wobble + white + drift
    return result


def gaps(
    p: Parameters, rng: np.random.Generator, n_frames: int, n_markers: int
) -> NDArray[np.bool_]:
    """Where markers are lost, (n_frames, n_markers); at least one gap a recording."""
    lost = np.zeros((n_frames, n_markers), dtype=bool)
    count = max(1, int(rng.poisson(p("gap_rate") * p("duration") * n_markers)))
    for _ in range(count):
        marker = int(rng.integers(n_markers))
        length = p("gap_median") * np.exp(p("gap_log_sd") * rng.standard_normal())
        frames = max(1, round(min(length, p("gap_longest")) * p("rate")))
        first = int(rng.integers(n_frames - frames))
        lost[first : first + frames, marker] = True
    return lost
