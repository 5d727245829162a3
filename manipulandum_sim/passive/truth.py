"""Truth of a simulated passive arm: its joints and its exact motion."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from typing import Annotated, Any

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.errors import RecordError
from armimpedance.core.motion import MarkerRecording, MotionRecording
from manipulandum_sim.truth_file import reading_values, write_values

_NAMES = ("joints", "coordinates")


@dataclass(frozen=True)
class PassiveTruth(FrozenRecord):
    """Truth of a recording; J passive joints, n coordinates, N samples of all trials.

    Attributes
    ----------
    test, subject : str
    joints : tuple of J str
        The hinges that moved freely.
    k, h, f, q_r, K : (J,)
        ``tau = -(k (q - q_r) + K (q - q_r)^2 + h qd + f sign(qd))``.
    coordinates : tuple of n str
    q, qd, qdd : (N, n)
        Exact at the frames, in the order of `coordinates`.
    torque : (N, J)
        What the passive joints exert, N m; the holding friction included.
    held : (N, J) bool
        Where a joint with dry friction is at rest: the friction is then whatever holds it, not
        ``f sign(qd)``. Such frames belong in no exact fit.
    """

    test: str
    subject: str
    joints: Annotated[tuple[str, ...], "J"]
    k: Annotated[FloatArray, "J"]
    h: Annotated[FloatArray, "J"]
    f: Annotated[FloatArray, "J"]
    q_r: Annotated[FloatArray, "J"]
    K: Annotated[FloatArray, "J"]
    coordinates: Annotated[tuple[str, ...], "n"]
    q: Annotated[FloatArray, "N n"]
    qd: Annotated[FloatArray, "N n"]
    qdd: Annotated[FloatArray, "N n"]
    torque: Annotated[FloatArray, "N J"]
    held: Annotated[BoolArray, "N J"]

    @property
    def columns(self) -> list[int]:
        """Where the J passive joints stand among the coordinates."""
        return [self.coordinates.index(joint) for joint in self.joints]

    def motion(self, recording: MarkerRecording) -> MotionRecording:
        """The exact motion of the recording that this is the truth of.

        Raises
        ------
        RecordError
            The recording has no skeleton, or is another one.
        """
        if recording.skeleton is None or recording.skeleton.coordinates != self.coordinates:
            raise RecordError("a recording of another skeleton than its truth")
        return MotionRecording(
            sample_rate_hz=recording.sample_rate_hz,
            trials=recording.trials,
            offsets=recording.offsets,
            time_s=recording.time_s,
            coordinates=self.q,
            skeleton=recording.skeleton,
            emg=recording.emg,
            subject=recording.subject,
            provenance=recording.provenance,
        )

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON (``truth.json``), arrays row by row; replaced at once or not at all."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        write_values(values, path)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> PassiveTruth:
        """Read what `write` wrote.

        Raises
        ------
        InputError
            If the file is not such a truth.
        """
        with reading_values(path, "a passive truth") as plain:
            values: dict[str, Any] = {
                k: np.array(v) if isinstance(v, list) and k not in _NAMES else v
                for k, v in plain.items()
            }
            return cls(**values)
