"""A varying stiffness as a robot may follow it: how fast it changes, what energy that adds.

A spring ``e^T K e / 2`` whose K changes gains ``e^T dK e / 2`` at a displacement e that nobody
moved: a growing stiffness is no passive spring.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


class VaryingSpring:
    """Follows a stiffness no faster than told and sums up the energy that its changes add.

    Parameters
    ----------
    limit_N_m_s : float or None
        Largest rate of change of any stiffness, N/m per s; None: no limit.
    step_s : float
        Nominal time between samples: after a gap the spring moves on as if twice as much had
        passed, and of stamps that nearly coincide no rate is told.

    Raises
    ------
    InputError
        A limit that is not positive.
    """

    def __init__(self, limit_N_m_s: float | None, step_s: float) -> None:
        if limit_N_m_s is not None and not limit_N_m_s > 0:
            raise InputError(f"a limit of {limit_N_m_s:g} N/m/s", expected="more than 0")
        self._limit, self._nominal = limit_N_m_s, step_s
        self._K: FloatArray | None = None
        self.growth_W_m2 = 0.0
        self.added_J = 0.0

    def follow(self, K: FloatArray, step_s: float, displacement: FloatArray | None) -> FloatArray:
        """The stiffness (d, d) to command where `K` is asked for.

        It lies between the last one and K, both positive definite, and so is positive definite.
        """
        if self._K is None:
            self._K = K
            return K
        step = min(step_s, 2 * self._nominal)
        change = K - self._K
        rates = np.linalg.eigvalsh(change)
        fastest = max(-rates[0], rates[-1])
        part = 1.0
        if self._limit is not None and fastest > self._limit * step:
            part = self._limit * step / fastest
            change = part * change
        shown = max(step, 0.1 * self._nominal)
        self.growth_W_m2 = max(float(part * rates[-1]) / (2 * shown), 0.0)
        if displacement is not None:
            self.added_J += float(displacement @ change @ displacement) / 2
        self._K = K if part == 1.0 else self._K + change
        return self._K
