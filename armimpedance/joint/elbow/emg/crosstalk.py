"""Does one electrode hear the other muscle? Told by the raw EMG of both, and taken out of it.

Two muscles' raw EMG are independent noises, however alike their amplitudes rise and fall. With a
part c_1 of the second muscle's EMG in the first channel, and c_2 the other way,

    x = A s,   A = [[1, c_1], [c_2, 1]],   Cov(x_1, x_2) = c_2 var(s_1) + c_1 var(s_2) + k

over blocks of the record, k being noise that both electrodes share. What motor units that fire in
step leave, a correlation that does not depend on the levels, is ``rho sd(s_1) sd(s_2)`` and no
crosstalk. A follows by relative steps: the covariances that are left are fitted, the channels
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

#: Above what motion leaves and common drive reaches, below what tissue damps, Hz.
BAND_HZ: Final = (60.0, 400.0)
#: Length of the blocks, s; fewer than so many tell nothing.
BLOCK_S: Final = 0.5
FEWEST_BLOCKS: Final = 12
#: Crosstalk as unlikely as this without any is told.
UNLIKELY: Final = 1e-3
#: Relative steps, and the one that ends them.
_ROUNDS, _SETTLED = 30, 1e-7
#: Gains that would be seen from this on only are not told at all.
VAGUE: Final = 0.2
#: Sd of the part of another muscle that a channel is supposed to hear where it cannot be told:
#: surface electrodes over neighbours hear up to 17 % (C. J. De Luca, R. Merletti, Electroenceph.
#: Clin. Neurophysiol. 69 (1988) 568-575).
SUPPOSED: Final = 0.1
#: Highest frequency over the rate; condition of the regressors beyond which nothing is told.
HIGHEST: Final = 0.45
WORST: Final = 1e3
#: Beyond this no channel is a muscle's own.
MOST: Final = 0.7


@dataclass(frozen=True)
class Crosstalk(FrozenRecord):
    """Parts of the other muscle's raw EMG in the channels of two muscles.

    `gain` (2,): of the second muscle's EMG (V) in the first channel, of the first's in the second.
    `covariance` (2, 2) or None: None where the EMG cannot tell: it is no raw EMG, or its levels do
    not differ.
    `p`: probability of gains as large if there is no crosstalk.
    """

    gain: Annotated[FloatArray, "2"]
    covariance: Annotated[FloatArray, "2 2"] | None = None
    p: float = 1.0

    @classmethod
    def of(cls, pair: Recording) -> Crosstalk:
        """What the two electrodes of a recording hear of the other muscle.

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
        told = None if len(blocks) < FEWEST_BLOCKS else _separated(np.stack(blocks))
        if told is None:
            return cls(np.zeros(2))
        gain, covariance = told
        return cls(gain, covariance, float(chdtrc(2, gain @ np.linalg.solve(covariance, gain))))

    @property
    def told(self) -> bool:
        """Whether the levels differ enough to tell the gains to a useful accuracy."""
        return self.covariance is not None and self._smallest < VAGUE

    @property
    def _smallest(self) -> float:
        """Gain that would have been seen in either channel: four standard errors."""
        C = np.full((2, 2), np.inf) if self.covariance is None else self.covariance
        return float(4 * np.sqrt(np.diag(C)).max())

    @property
    def seen(self) -> bool:
        """Whether it is there, and taken out."""
        return self.told and self.p < UNLIKELY

    def own(self, pair: Recording) -> Recording:
        """The recording with each muscle's own EMG, ``s = A^-1 x``, where crosstalk was seen."""
        return _unmixed(pair, self.gain) if self.seen else pair

    def neighbours(self, pair: Recording) -> tuple[Recording, ...]:
        """The same of gains that are off by a standard error, in either direction of theirs."""
        if self.covariance is None or not self.seen:
            return ()
        errors = np.linalg.cholesky(self.covariance).T
        return tuple(_unmixed(pair, self.gain + error) for error in errors)

    def finding(self, muscles: tuple[str, ...]) -> Finding:
        """What to say of it, of channels of these names."""
        if self.covariance is None or not self.told:
            said = "the EMG does not tell it (no raw EMG, or levels that are all alike)"
            return Finding("crosstalk", "cannot tell", said)
        sd = np.sqrt(np.diag(self.covariance))
        sizes = [f"{100 * c:+.1f} +-{200 * s:.1f} %" for c, s in zip(self.gain, sd, strict=True)]
        said = (
            f"{sizes[0]} of {muscles[1]}'s EMG in {muscles[0]}'s channel, {sizes[1]} in the other"
        )
        smallest = f"{100 * self._smallest:.1f} %"
        if not self.seen:
            return Finding("crosstalk", "ok", said, smallest)
        done = "taken out before the amplitudes were made; put the electrodes further apart"
        return Finding("crosstalk", "warning", f"{said}: {done}", smallest)


def _separated(C: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Gains (2,) that leave no part of either variance in covariances C (b, 2, 2), and their own.

    None where the levels do not tell them from shared noise and a constant correlation.
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
    left = r - X @ step
    covariance = np.linalg.inv(X.T @ X)[:2, :2] * (left @ left) / (len(r) - X.shape[1])
    return np.array([A[0, 1], A[1, 0]]), covariance


def _unmixed(pair: Recording, gain: FloatArray) -> Recording:
    A = np.array([[1.0, gain[0]], [gain[1], 1.0]])
    return replace(pair, emg=np.asarray(pair.emg) @ np.linalg.inv(A).T)
