"""Profiles as CSV for a robot: equally spaced samples of the commanded course."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import unchanged
from armimpedance.core.outputs import staged_file
from armimpedance.hand.planning.profile import Profile

#: Columns, after two lines of comment.
COLUMNS: Final = ("time_s", "displacement_m", "velocity_m_s", "acceleration_m_s2")
#: Profiles that come with the package, at 1 kHz.
SHIPPED: Final = ("designed", "reflex_separating")


def sampled(profile: Profile, rate_hz: float = 1000.0) -> FloatArray:
    """Time, displacement, velocity, acceleration (S, 4), from the onset to the end.

    Raises
    ------
    InputError
        If the duration is no whole number of samples: the robot would stop before the end.
    """
    samples = profile.duration_s * rate_hz
    if not (np.isfinite(samples) and abs(samples - round(samples)) < 1e-6 and samples >= 10):
        raise InputError(
            f"{profile.duration_s:g} s at {rate_hz:g} Hz", expected="a whole number of samples"
        )
    time = np.arange(round(samples) + 1) / rate_hz
    course = profile.at(time)
    # what rounding leaves where the course rests
    course[np.abs(course) < 1e-9 * np.abs(course).max(axis=1, keepdims=True)] = 0.0
    return np.column_stack([time, course.T])


def write_profile(profile: Profile, path: str | Path, rate_hz: float = 1000.0) -> None:
    """Write it under a temporary name and rename."""
    values = sampled(profile, rate_hz)
    heading = (
        f"# {profile.shape.name}: {1e3 * profile.amplitude_m:g} mm in {profile.duration_s:g} s, "
        f"peak acceleration {profile.peak_acceleration:.3g} m/s^2, {rate_hz:g} Hz\n"
        "# commanded course along the direction of the disturbance; time from the onset in s, "
        "then m, m/s, m/s^2\n"
    )
    with staged_file(path) as staged, staged.open("w", encoding="utf-8", newline="\n") as file:
        file.write(heading + ",".join(COLUMNS) + "\n")
        for time, *motion in values:
            file.write(",".join([f"{time:.6f}", *(f"{value:.9g}" for value in motion)]) + "\n")


def read_profile(path: str | Path) -> FloatArray:
    """The samples (S, 4) of a file that `write_profile` made."""
    try:
        with unchanged(path):
            return np.loadtxt(path, delimiter=",", skiprows=3, ndmin=2)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", file=path, expected="a profile.csv") from error


def shipped_profile(name: str) -> FloatArray:
    """The samples (S, 4) of a profile that comes with the package, 5 mm in 0.3 s.

    Parameters
    ----------
    name : {"designed", "reflex_separating"}

    Returns
    -------
    (S, 4)
        Time, displacement, velocity, acceleration at 1 kHz.

    Raises
    ------
    InputError
        If there is no such profile.
    """
    if name not in SHIPPED:
        raise InputError(f"no profile {name!r}", expected=" or ".join(SHIPPED))
    return read_profile(str(files("armimpedance.hand.planning") / "profiles" / f"{name}.csv"))
