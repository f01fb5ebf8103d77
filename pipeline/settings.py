"""One frozen dataclass of settings a stage; the values live in config/config.yaml alone."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True, slots=True)
class MarkerSettings:
    """Reading and cleaning a recording.

    max_gap_s : longer gaps are not filled
    min_seen : share of the time a marker must be seen to be used
    max_rate_hz : faster recordings are reduced to at most this
    low_rate_hz : slower ones get a warning of what they cannot resolve
    cutoff_hz : of the zero-phase low-pass
    assumed_rate_hz : of a text table that states neither times nor a rate
    flicker_m : smallest jump between two positions that counts as ghosting
    """

    max_gap_s: float
    min_seen: float
    max_rate_hz: float
    low_rate_hz: float
    cutoff_hz: float
    assumed_rate_hz: float
    flicker_m: float


@dataclass(frozen=True, kw_only=True, slots=True)
class SignatureSettings:
    """Finding breaths and averaging them.

    n_phase : samples of the mean cycle
    search_hz : low-pass of the signal in the first search for turning points
    hysteresis : share of the local breath size that a turn must come back to count
    local_s : s on either side over which breath size is taken
    smallest_share : turns smaller than this share of the recording's breath size never count
    min_duration_s : shorter recordings hold no readable breath
    min_amplitude_m : smallest median breath, root mean square over the markers
    max_travel_m, max_tilt_rad : of the trunk; beyond, no breath can be told from the motion
    few_cycles : up to so many whole cycles, none is left out as unusual
    sigh_ratio : larger than so many times the median breath is a sigh
    outlier_ratio : smaller or shorter than the median by this ratio, or longer, is left out
    drift_share : a cycle that ends this share of its size away from its start is left out
    """

    n_phase: int
    search_hz: float
    hysteresis: float
    local_s: float
    smallest_share: float
    min_duration_s: float
    min_amplitude_m: float
    max_travel_m: float
    max_tilt_rad: float
    few_cycles: int
    sigh_ratio: float
    outlier_ratio: float
    drift_share: float


@dataclass(frozen=True, kw_only=True, slots=True)
class FitSettings:
    """Fitting the torso to a breath signature.

    algorithm : one of `pipeline.optimise.ALGORITHMS`
    markers : "all" or "sagittal", the markers that the optimiser sees
    velocity_weight_s : s, weight of error_v beside error_p; 0 leaves it out
    velocity_window_s : s over which a velocity is taken, for model and recording alike
    frame_rate_hz : frames of the model's breath
    n_initial, n_starts, n_evaluations : runs before the search, starts of nlopt, runs in total
    level_tolerance : the search stops at steps this small
    upper_level : largest maximum activation allowed
    failed_penalty : cost of a failed run, in errors of not moving
    heldout_every, heldout_evaluations : every which breath is held out, runs for its fit
    spine : whether the bend of the spine with the breath is estimated, upright
    min_cycles : with fewer breaths no verdict is given
    n_cycle_checks : breaths whose fit through the emulator is checked by a real run
    scale_sd, rotation_sd_rad, landmark_sd_m, surface_sd_m, height_sd_m : how far size, axes,
        landmarks and skin may stray in the registration (one standard deviation)
    min_scale_markers : with fewer markers the size stays that of the table
    marker_radius_m : distance of a marker's centre from the skin
    """

    algorithm: str
    markers: str
    velocity_weight_s: float
    velocity_window_s: float
    frame_rate_hz: float
    n_initial: int
    n_starts: int
    n_evaluations: int
    level_tolerance: float
    upper_level: float
    failed_penalty: float
    heldout_every: int
    heldout_evaluations: int
    spine: bool
    min_cycles: int
    n_cycle_checks: int
    scale_sd: float
    rotation_sd_rad: float
    landmark_sd_m: float
    surface_sd_m: float
    height_sd_m: float
    min_scale_markers: int
    marker_radius_m: float


@dataclass(frozen=True, kw_only=True, slots=True)
class PosteriorSettings:
    """Emulator and sampling.

    n_design : designed runs in all, those of the fit included
    n_rounds : rounds in which the runs beyond the fit's are placed where levels are plausible
    max_emulator_share : largest part of the residual variance that may be the emulator's
    noise_floor_m : smallest marker noise believed (instrument)
    discrepancy_scale_m : half-normal scale of the model's own misfit
    n_ensembles, n_walkers, max_steps, min_taus : independent ensembles; a chain stops at
        min_taus autocorrelation times or at max_steps
    probability : of every interval
    n_draws : draws kept of each ensemble
    """

    n_design: int
    n_rounds: int
    max_emulator_share: float
    noise_floor_m: float
    discrepancy_scale_m: float
    n_ensembles: int
    n_walkers: int
    max_steps: int
    min_taus: int
    probability: float
    n_draws: int


@dataclass(frozen=True, kw_only=True, slots=True)
class AudioSettings:
    """Reading a sound file.

    rate_hz : faster recordings are reduced to this
    highpass_hz : below it is no voice (rumble, wind, offset)
    min_duration_s, max_duration_s : of the part that is used
    clipped_share : share of samples on a flat top from which on the recording is called clipped
    """

    rate_hz: float
    highpass_hz: float
    min_duration_s: float
    max_duration_s: float
    clipped_share: float


@dataclass(frozen=True, kw_only=True, slots=True)
class PressureSettings:
    """From loudness to lung pressure.

    cutoff_hz : of the first-order Butterworth low-pass of the rectified sound
    passes : 1 as published (its delay is taken off), 2 there and back
    map : "linear" as published, or "power"
    intensity : factor on the pressure, to exaggerate or tone down
    active_share : sound over this share of the mean peak belongs to a laugh
    fade_s : in which the pressure of a bout comes from nothing and goes there
    probability : of every interval
    block_s : samples that the bootstrap draws together
    n_bootstrap : draws of the bootstrap
    table_rate_hz : rows a second of pressure.csv
    """

    cutoff_hz: float
    passes: int
    map: str
    intensity: float
    active_share: float
    fade_s: float
    probability: float
    block_s: float
    n_bootstrap: int
    table_rate_hz: float

    def __post_init__(self) -> None:
        if self.map not in ("linear", "power"):
            raise ValueError("map is linear or power.")
        if self.passes not in (1, 2):
            raise ValueError("passes is 1 or 2.")
        if not 0.5 <= self.cutoff_hz <= 100.0:
            raise ValueError("cutoff_hz is from 0.5 to 100.")
        if self.intensity <= 0.0 or not 0.0 < self.probability < 1.0:
            raise ValueError("intensity is over 0, probability between 0 and 1.")
        if not 1.0 <= self.table_rate_hz <= 1000.0:
            raise ValueError("table_rate_hz is from 1 to 1000.")


@dataclass(frozen=True, kw_only=True, slots=True)
class CallSettings:
    """Finding calls and bouts, and telling laughter from what is none.

    envelope_hz : low-pass in which calls are told apart
    stronger : take the floor under the valleys off, for sound that echoes or is muddy
    prominence_db : a call stands out of its valleys by as much
    depth_db : a peak so far below the loudest within 1.5 s is none
    apart_s : two calls are at least so far apart
    gap_s : a longer time between two peaks ends a bout
    voiced_periodicity : median periodicity at the peak from which on a call is voiced
    min_calls : voiced calls that a bout needs to be judged by itself
    min_calls_all : voiced calls of all such bouts, to be told from a spoken "ha ha"
    min_probability : of laughter, from which on a bout is one
    context_s : bouts so near to laughter, and alike, belong to it
    machine_irregularity : intervals less uneven than this are no living thing's
    """

    envelope_hz: float
    stronger: bool
    prominence_db: float
    depth_db: float
    apart_s: float
    gap_s: float
    voiced_periodicity: float
    min_calls: int
    min_calls_all: int
    min_probability: float
    context_s: float
    machine_irregularity: float


@dataclass(frozen=True, kw_only=True, slots=True)
class FollowSettings:
    """Letting the torso follow a sound.

    kind : "auto", or what the sound is: "laugh", "cough", "sneeze", "breath"
    lung : "two_way", or "one_way" as published, which has no larynx
    algorithm : of the search, one of `pipeline.optimise.ALGORITHMS`
    compared : searches of the loudest call beside it, for the figure of error against runs
    n_evaluations : runs for a call; compared_evaluations : of each compared search
    n_starts : searches side by side, each with a smaller first step
    linear_steps : steps before the search that take pressure as proportional to activation
    first_step, tolerance : of the search, in the unit box of the parameters
    goal : normalised error at which a search ends
    step_s : of the simulation
    frames_per_s : of the trajectory
    max_duration_s : longer sounds are refused: name a part
    motion : whether back and shoulders are moved on top
    strength : factor on the flow of coughs, sneezes and breaths (a laugh has pressure.intensity)
    """

    kind: str
    lung: str
    algorithm: str
    compared: tuple[str, ...]
    n_evaluations: int
    compared_evaluations: int
    n_starts: int
    linear_steps: int
    first_step: float
    tolerance: float
    goal: float
    step_s: float
    frames_per_s: float
    max_duration_s: float
    motion: bool
    strength: float

    def __post_init__(self) -> None:
        if not 0.0 < self.strength <= 2.0:
            raise ValueError("strength is over 0 and at most 2.")
        if self.kind not in ("auto", "laugh", "cough", "sneeze", "breath"):
            raise ValueError("kind is auto, laugh, cough, sneeze or breath.")
        if self.lung not in ("two_way", "one_way"):
            raise ValueError("lung is two_way or one_way.")
        if min(self.n_evaluations, self.compared_evaluations, self.n_starts) < 1:
            raise ValueError("n_evaluations, compared_evaluations and n_starts are 1 or more.")
        if self.linear_steps < 0 or not 0.0 < self.first_step <= 1.0 or self.tolerance <= 0.0:
            raise ValueError("linear_steps is 0 or more, first_step in 0 to 1, tolerance over 0.")
        if self.goal < 0.0:
            raise ValueError("goal is 0 or more.")
        if not 5e-4 <= self.step_s <= 2e-3 or not 1.0 <= self.frames_per_s <= 200.0:
            raise ValueError("step_s is from 0.0005 to 0.002, frames_per_s from 1 to 200.")


@dataclass(frozen=True, kw_only=True, slots=True)
class PapersSettings:
    """The page that makes the papers' figures anew.

    map_contractions, map_periods : runs of the map of breaths along its two axes
    map_least_level, map_most_level : contraction, level of the external intercostals
    map_shortest_s, map_longest_s : period of a breath
    map_settle_s : a run lasts at least as long before its last breath is taken
    map_fine_below_s : breaths shorter than this take half the usual step
    map_batch : runs that a kill may cost
    ball_mass_kg, ball_height_m : of the ball that falls on the belly
    """

    map_contractions: int
    map_periods: int
    map_least_level: float
    map_most_level: float
    map_shortest_s: float
    map_longest_s: float
    map_settle_s: float
    map_fine_below_s: float
    map_batch: int
    ball_mass_kg: float
    ball_height_m: float

    def __post_init__(self) -> None:
        if min(self.map_contractions, self.map_periods) < 2 or self.map_batch < 1:
            raise ValueError("map_contractions and map_periods are 2 or more, map_batch 1 or more.")
        if not 0.0 < self.map_least_level < self.map_most_level <= 1.0:
            raise ValueError("map_least_level is over 0, under map_most_level, which is at most 1.")
        if not 0.2 <= self.map_shortest_s < self.map_longest_s:
            raise ValueError("map_shortest_s is at least 0.2 and under map_longest_s.")


@dataclass(frozen=True, kw_only=True, slots=True)
class RetrainingSettings:
    """Steps from a person's breath to a slower, more diaphragmatic one.

    n_steps : after the person's own breath; the last is the target
    rate_per_min : of the target; six a minute is the usual slow breathing (Russo 2017, recalled)
    belly_share : of the target's tidal volume, by the belly wall; the diaphragm alone gives some
        three quarters upright, an ordinary breath of this torso two fifths to a half
    inspiration_share : of the target's breath, in: out is half as long again
    dead_space_ml_per_kg : a breath a minute less is made up for so that the alveoli get as much
        air; 1 mL a pound (Radford 1955, recalled)
    tolerance : of a swept volume, as a share of the tidal volume
    n_runs : of the torso, a step
    frame_rate_hz : of the kept breaths
    """

    n_steps: int
    rate_per_min: float
    belly_share: float
    inspiration_share: float
    dead_space_ml_per_kg: float
    tolerance: float
    n_runs: int
    frame_rate_hz: float

    def __post_init__(self) -> None:
        if not 1 <= self.n_steps <= 8 or self.n_runs < 1:
            raise ValueError("n_steps is from 1 to 8, n_runs 1 or more.")
        if not 3.0 <= self.rate_per_min <= 30.0:
            raise ValueError("rate_per_min is from 3 to 30.")
        if not 0.0 < self.belly_share < 1.0:
            raise ValueError("belly_share is over 0 and under 1.")
        if not 0.2 <= self.inspiration_share <= 0.6:
            raise ValueError("inspiration_share is from 0.2 to 0.6.")
        if not 0.0 <= self.dead_space_ml_per_kg <= 5.0 or self.tolerance <= 0.0:
            raise ValueError("dead_space_ml_per_kg is from 0 to 5, tolerance over 0.")
        if not 12.0 <= self.frame_rate_hz <= 100.0:
            raise ValueError("frame_rate_hz is from 12 to 100.")
