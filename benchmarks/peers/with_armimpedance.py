"""This package, by its Python interface: the default method, `exact`, and with all checks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
from record import Hand, Joint

import armimpedance as ai
from armimpedance.core.records import Recording
from armimpedance.hand.still import Options, estimate
from armimpedance.joint.elbow import JointSamples, estimate_joint, identify_elbow
from armimpedance.numerics.regression import Parameters

Arrays = tuple[np.ndarray, np.ndarray]


def recording_of(hand: Hand) -> Recording:
    """The same samples as a recording of this package."""
    trials, samples = hand.position.shape[:2]
    # the window's first sample is time 0 of a trial's own clock
    onset = -hand.lag_s[0]
    table = pd.DataFrame(
        {
            "trial": np.arange(1, trials + 1),
            "condition": [f"c{i // hand.each:05d}" for i in range(trials)],
            "direction_deg": 45.0 * (np.arange(trials) % 8),
            "onset_s": onset,
            "end_s": onset + 0.3,
        }
    )
    return Recording(
        kind="hand",
        sample_rate_hz=hand.rate_hz,
        trials=table,
        offsets=np.arange(trials + 1) * samples,
        time_s=np.tile(np.arange(samples) / hand.rate_hz, trials),
        position=hand.position.reshape(-1, 2),
        force=hand.force.reshape(-1, 2),
    )


def _estimates(hand: Hand, options: Options) -> Arrays:
    found = estimate(recording_of(hand), options=options)
    return np.stack([e.parameters for e in found]), np.stack([_half(e.interval()) for e in found])


def _half(limits: np.ndarray) -> np.ndarray:
    return ((limits[1] - limits[0]) / 2).ravel()


def hand(record: Hand) -> Arrays:
    """The default, which learns the noise of each condition."""
    return _estimates(record, Options())


def hand_exact(record: Hand) -> Arrays:
    """Plain least squares on exact derivatives, the same intervals."""
    return _estimates(record, Options("exact", bound=False))


def hand_definite(record: Hand) -> Arrays:
    """The default, and of its results the nearest symmetric positive semidefinite matrices."""
    return _estimates(record, Options("definite"))


def hand_sessions(record: Hand) -> Arrays:
    """The default over recordings of a thousand trials, one after another."""
    parts = []
    for start in range(0, len(record.position), 1000):
        kept = slice(start, start + 1000)
        part = replace(record, position=record.position[kept], force=record.force[kept])
        parts.append(_estimates(part, Options()))
    values, half = zip(*parts, strict=True)
    return np.concatenate(values), np.concatenate(half)


def hand_checked(record: Hand) -> Arrays:
    """As the command does it: every check first, intervals that allow for what it cannot see."""
    found = ai.estimate(recording_of(record))
    return np.stack([e.parameters for e in found]), np.stack([_half(e.interval()) for e in found])


def _joint(record: Joint, fit: Callable[[JointSamples], Parameters]) -> Arrays:
    """Told what all peers take for granted: the torque was imposed."""
    ends = np.array([0, record.angle.shape[1]])
    found = []
    for angle, torque in zip(record.angle, record.torque, strict=True):
        samples = JointSamples(record.rate_hz, ("1",), ends, torque, angle, imposed="torque")
        found.append(fit(samples))
    half = np.stack([np.diff(p.interval(), axis=1)[:, 0] / 2 for p in found])
    return np.stack([p.values for p in found]), half


def joint(record: Joint) -> Arrays:
    """I, B and K and nothing else, as the peers have it, by the default method."""
    return _joint(record, estimate_joint)


def joint_checked(record: Joint) -> Arrays:
    """As the command does it: I, B and K beside a reflex, a skew and a law that bends."""
    return _joint(record, lambda samples: identify_elbow(samples).parameters)
