"""A motion-capture studio: what its cameras and amplifiers make of a moving body.

Works for any skeleton with marker sites.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals, MarkerRecording, MotionRecording
from manipulandum_sim.tree_dynamics import marker_positions, move


@dataclass(frozen=True)
class Studio:
    """Accuracy of the studio's cameras.

    Attributes
    ----------
    marker_noise_m : float
        Sd of white noise, each axis of each marker in each frame.
    soft_tissue_m : float
        Sd, over a trial, of each marker's slow slide on its bone (`skin_slide`).
    dropout : float
        Share of the frames in which a marker is not seen, in bursts.
    burst_s : float
        Mean length of a burst; lengths are geometric, one frame at least.
    longest_burst_s : float
        No burst is longer.
    """

    marker_noise_m: float = 0.5e-3
    soft_tissue_m: float = 0.0
    dropout: float = 0.0
    burst_s: float = 0.1
    longest_burst_s: float = 0.3

    def __post_init__(self) -> None:
        for name in ("marker_noise_m", "soft_tissue_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"{name} is {value}", expected="0 or more")
        if not 0 <= self.dropout < 1:
            raise InputError(f"dropout is {self.dropout}", expected="at least 0, less than 1")
        if not 0 < self.burst_s <= self.longest_burst_s:
            raise InputError(
                f"bursts of {self.burst_s} s on average, {self.longest_burst_s} s at most",
                expected="0 < burst_s <= longest_burst_s",
            )


def film(
    motion: MotionRecording,
    studio: Studio | None = None,
    *,
    seed: int = 0,
    emg: EmgSignals | None = None,
) -> MarkerRecording:
    """Film a body's exact motion.

    Parameters
    ----------
    motion : MotionRecording
        Its skeleton says where the markers sit. Plates, subject and provenance are handed on.
    studio : Studio, optional
    seed : int
        A trial's disturbances depend on the seed and the trial's number alone.
    emg : EmgSignals, optional
        Instead of the motion's own.

    Returns
    -------
    MarkerRecording

    Raises
    ------
    InputError
        The skeleton has no markers.
    """
    skeleton, studio = motion.skeleton, studio or Studio()
    if not skeleton.markers:
        raise InputError("a skeleton without markers cannot be filmed")
    seen = marker_positions(skeleton, motion.coordinates)
    for row, trial in enumerate(motion.trials["trial"]):
        at = motion.samples_of(row)
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(trial), 2)))
        noise = rng.standard_normal(seen[at].shape)
        slide = skin_slide(motion, row, rng) if studio.soft_tissue_m > 0 else 0.0
        seen[at] += studio.marker_noise_m * noise + studio.soft_tissue_m * slide
        lost = dropouts(seen[at].shape[:2], motion.sample_rate_hz, studio, rng)
        seen[at][lost] = np.nan
    return MarkerRecording(
        sample_rate_hz=motion.sample_rate_hz,
        trials=motion.trials,
        offsets=motion.offsets,
        time_s=motion.time_s,
        positions=seen,
        names=skeleton.marker_names,
        skeleton=skeleton,
        wrenches=motion.wrenches,
        plate_origins_m=motion.plate_origins_m,
        emg=motion.emg if emg is None else emg,
        subject=motion.subject,
        provenance=(*motion.provenance, f"filmed, seed {seed}"),
    )


def skin_slide(motion: MotionRecording, row: int, rng: np.random.Generator) -> FloatArray:
    """Shift of each marker off its bone with the skin, (S, P, 3) m per m of sd.

    In the segment's frame a marker slides along a random line, in proportion to a random mixture
    of the segment's joint angles: where the joint goes, the skin is pulled. The root's markers
    slide with the hinges of the segments that hang on it. Zero mean, unit sd over the trial (3D).
    """
    skeleton, q = motion.skeleton, motion.coordinates[motion.samples_of(row)]
    turn = move(skeleton, q).rotation
    slide = np.zeros((len(q), len(skeleton.markers), 3))
    for m, site in enumerate(skeleton.markers):
        pull = _pull(motion, site.segment, q)
        weights, line = rng.standard_normal(pull.shape[1]), rng.standard_normal(3)
        course = (pull - pull.mean(axis=0)) @ weights
        sd = course.std()
        if sd > 0:
            along = line / np.linalg.norm(line)
            slide[:, m] = (course / sd)[:, None] * (turn[skeleton.index(site.segment)] @ along)
    return slide


def _pull(motion: MotionRecording, segment: str, q: FloatArray) -> FloatArray:
    """Angles (S, a) of the joint that carries a segment, or of those that hang on the root."""
    skeleton = motion.skeleton
    root = skeleton.segments[0].name
    hinges = [
        h.name
        for s in skeleton.segments
        for h in s.hinges
        if s.name == segment or (segment == root and s.parent == root)
    ]
    return q[:, [skeleton.coordinate(h) for h in hinges]]


def dropouts(
    shape: tuple[int, ...], rate_hz: float, studio: Studio, rng: np.random.Generator
) -> np.ndarray:
    """Which markers are lost in which frames, (S, P) bool: a share of `dropout`, in bursts."""
    samples, markers = shape
    lost = np.zeros((samples, markers), dtype=bool)
    if studio.dropout == 0:
        return lost
    longest = max(1, round(studio.longest_burst_s * rate_hz))
    ends = 1 / max(1.0, studio.burst_s * rate_hz)
    # mean length of a geometric burst cut at `longest`
    mean = (1 - (1 - ends) ** longest) / ends
    begins = studio.dropout / (mean * (1 - studio.dropout) + studio.dropout)
    for marker in range(markers):
        frame = int(rng.geometric(begins)) - 1
        while frame < samples:
            burst = min(int(rng.geometric(ends)), longest)
            lost[frame : frame + burst, marker] = True
            frame += burst + int(rng.geometric(begins))
    return lost
