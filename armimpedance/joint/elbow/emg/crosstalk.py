"""Estimate the crosstalk between two muscles' electrodes from raw EMG, and remove it.

The raw EMG of two muscles are independent noises, even if their amplitudes rise and fall together.
With a share c_1 of the second muscle's EMG in the first channel, and c_2 of the first's in the
second,

    x = A s,   A = [[1, c_1], [c_2, 1]],   Cov(x_1, x_2) = c_2 var(s_1) + c_1 var(s_2) + k

over blocks of the record; k is noise that both electrodes share. Motor units that fire together
give a correlation that does not depend on the levels, ``rho sd(s_1) sd(s_2)``; this is not
crosstalk. A is estimated by relative steps: the remaining covariances are fitted, the channels
unmixed, and fitted again (J.-F. Cardoso, B. Laheld, IEEE Trans. Signal Process. 44 (1996)
3017-3030, for the relative step).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
from scipy.special import chdtrc

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.numerics.signals import bandpass

#: Band of the EMG, Hz: above motion artefacts and common drive, below what tissue damps.
BAND_HZ: Final = (60.0, 400.0)
#: Length of the blocks, s, and least number of them for an estimate.
BLOCK_S: Final = 0.5
FEWEST_BLOCKS: Final = 12
#: Crosstalk is reported if its p value is below this.
UNLIKELY: Final = 1e-3
#: Largest number of relative steps, and the size of a step that ends them.
_ROUNDS, _SETTLED = 30, 1e-7
#: If only gains above this could be detected, the estimate is not used.
VAGUE: Final = 0.2
#: Prior sd of the share of another muscle in a channel, used if it cannot be estimated: surface
#: electrodes over neighbours record up to 17 % (C. J. De Luca, R. Merletti, Electroenceph.
#: Clin. Neurophysiol. 69 (1988) 568-575).
SUPPOSED: Final = 0.1
#: Highest frequency over the sample rate; largest condition number of the regressors.
HIGHEST: Final = 0.45
WORST: Final = 1e3
#: Largest gain for which a channel can still be called a muscle's own.
MOST: Final = 0.7


@dataclass(frozen=True)
class Crosstalk(FrozenRecord):
    """Shares of the other muscle's raw EMG in the channels of two muscles.

    `gain` (2,): of the second muscle's EMG (V) in the first channel, of the first's in the second.
    `covariance` (2, 2) or None: None if the gains cannot be estimated: the EMG is not raw, or its
    levels do not differ.
    `p`: probability of gains as large if there is no crosstalk.
    """

    gain: Annotated[FloatArray, "2"]
    covariance: Annotated[FloatArray, "2 2"] | None = None
    p: float = 1.0

    @classmethod
    def of(cls, pair: Recording) -> Crosstalk:
        """Estimate the crosstalk of the two electrodes of a recording.

        `pair`: with the EMG of two muscles.
        """
        rate = pair.sample_rate_hz
        high = min(BAND_HZ[1], HIGHEST * rate)
        if pair.emg is None or pair.emg_unit == "normalised" or high < 2 * BAND_HZ[0]:
            return cls(np.zeros(2))
        blocks = []
        for t in range(pair.n_trials):
            emg = pair.emg[pair.samples_of(t)]
            emg = bandpass(emg - emg.mean(axis=0), BAND_HZ[0], high, rate, axis=0)
            count = max(int(len(emg) / (BLOCK_S * rate)), 1)
            # covariance (2, 2) of each block
            blocks += [part.T @ part / len(part) for part in np.array_split(emg, count)]
        estimate = None if len(blocks) < FEWEST_BLOCKS else _separated(np.stack(blocks))
        if estimate is None:
            return cls(np.zeros(2))
        gain, covariance = estimate
        return cls(gain, covariance, float(chdtrc(2, gain @ np.linalg.solve(covariance, gain))))

    @property
    def told(self) -> bool:
        """True if the levels differ enough to estimate the gains with useful accuracy."""
        return self.covariance is not None and self._smallest < VAGUE

    @property
    def _smallest(self) -> float:
        """Smallest gain that would have been detected in either channel: four standard errors."""
        C = np.full((2, 2), np.inf) if self.covariance is None else self.covariance
        return float(4 * np.sqrt(np.diag(C)).max())

    @property
    def seen(self) -> bool:
        """True if crosstalk was detected, and is removed."""
        return self.told and self.p < UNLIKELY

    def own(self, pair: Recording) -> Recording:
        """Return the recording with each muscle's own EMG, ``s = A^-1 x``, if crosstalk was
        detected.
        """
        return _unmixed(pair, self.gain) if self.seen else pair

    def neighbours(self, pair: Recording) -> tuple[Recording, ...]:
        """Recordings unmixed with gains that are off by a standard error, in two directions."""
        if self.covariance is None or not self.seen:
            return ()
        errors = np.linalg.cholesky(self.covariance).T
        return tuple(_unmixed(pair, self.gain + error) for error in errors)

    def finding(self, muscles: tuple[str, ...]) -> Finding:
        """Finding on the crosstalk between channels of these names."""
        if self.covariance is None or not self.told:
            text = "the EMG does not tell it (no raw EMG, or levels that are all alike)"
            return Finding("crosstalk", "cannot tell", text)
        sd = np.sqrt(np.diag(self.covariance))
        sizes = [f"{100 * c:+.1f} +-{200 * s:.1f} %" for c, s in zip(self.gain, sd, strict=True)]
        text = (
            f"{sizes[0]} of {muscles[1]}'s EMG in {muscles[0]}'s channel, {sizes[1]} in the other"
        )
        smallest = f"{100 * self._smallest:.1f} %"
        if not self.seen:
            return Finding("crosstalk", "ok", text, smallest)
        advice = "taken out before the amplitudes were made; put the electrodes further apart"
        return Finding("crosstalk", "warning", f"{text}: {advice}", smallest)


def _separated(C: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Gains (2,) and their covariance that explain the covariances C (b, 2, 2) of the channels.

    None if they cannot be distinguished from shared noise and a constant correlation.
    """
    A = np.eye(2)
    for _ in range(_ROUNDS):
        inverse = np.linalg.inv(A)
        own = inverse @ C @ inverse.T
        v1, v2 = own[:, 0, 0], own[:, 1, 1]
        if not (np.minimum(v1, v2) > 0).all():
            return None
        both = np.sqrt(v1 * v2)
        r = own[:, 0, 1] / both
        # correlation r (b,) = X (b, 4) [d_1, d_2, k, rho], of equal errors
        X = np.stack([v2, v1, np.full_like(both, both.min()), both], axis=1) / both[:, None]
        if not np.linalg.cond(X / np.linalg.norm(X, axis=0)) < WORST:
            return None
        step = np.linalg.lstsq(X, r, rcond=None)[0]
        A = A @ np.array([[1.0, step[0]], [step[1], 1.0]])
        A = A / np.diag(A)
        if not np.abs(A - np.eye(2)).max() < MOST:
            return None
        if np.abs(step[:2]).max() < _SETTLED:
            break
    residual = r - X @ step
    covariance = np.linalg.inv(X.T @ X)[:2, :2] * (residual @ residual) / (len(r) - X.shape[1])
    return np.array([A[0, 1], A[1, 0]]), covariance


def _unmixed(pair: Recording, gain: FloatArray) -> Recording:
    A = np.array([[1.0, gain[0]], [gain[1], 1.0]])
    return replace(pair, emg=np.asarray(pair.emg) @ np.linalg.inv(A).T)
