"""Does the joint depend on how far and how fast it moves? Terms of amplitude beside the best limb.

Stiffness that rises or falls with the deflection bends torque over angle by theta^2 and theta^3,
friction by the sign of the velocity. Of a Gaussian motion they have parts that no linear limb
makes, whatever its reflexes, and these are what is looked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.doubts.contest import KINDS, Contest
from armimpedance.joint.elbow.doubts.whittle import fit_models

STIFFENS: Final = (0, 1)
RUBS: Final = (2, 3)
#: By how much the deviance must fall: chance does so once in some thousand records.
LIKELIER: Final = 20.0
#: What a further pair of terms must be worth.
_WORTH: Final = 12.0


@dataclass(frozen=True, eq=False)
class Bent:
    """The terms of amplitude that the record asks for.

    Attributes
    ----------
    terms : tuple of int
        Numbers among `record.BENDS`; () where none is clearly there.
    gain : float
        By how much the deviance falls with all of them.
    smallest : float
        The smallest change of the stiffness at the rms deflection that would have been seen,
        N m/rad.
    """

    terms: tuple[int, ...]
    gain: float
    smallest: float


def bent(made: Contest, deflection: float) -> Bent:
    """Judge the terms of amplitude beside the best of a contest without them.

    Parameters
    ----------
    made : Contest
    deflection : float
        Rms of the angle, rad.
    """
    kind = min(KINDS, key=lambda k: made.best(k)[0])
    without, number = made.best(kind)
    columns = [made.rows.limb[..., : 4 if kind.late_angle else 3]]
    if kind.answers:
        columns.append(made.rows.late[:, :, number, : kind.answers])
    y = made.rows.y + made.about.lateness_s * made.rows.limb[..., 3]
    deviance, smallest = {}, np.inf
    for terms in (STIFFENS, RUBS, (*STIFFENS, *RUBS)):
        X = np.concatenate([*columns, made.rows.bends[..., list(terms)]], axis=2)
        fit = fit_models(X[None], y, made.rows.spectrum, np.zeros(X.shape[2]))
        deviance[terms] = float(fit.deviance[0])
        if terms == STIFFENS:
            C = np.linalg.inv(fit.information[0])
            # The slope of c theta^3 has the mean 3 c <theta^2>.
            smallest = 3 * deflection**2 * float(np.sqrt(LIKELIER * C[-1, -1]))
    best = min(deviance, key=lambda t: deviance[t] + _WORTH * len(t) / 2)
    gain = without - min(deviance.values())
    clear = without - deviance[best] > LIKELIER
    return Bent(best if clear else (), gain, smallest)


def stiffening(values: FloatArray, deflection: float) -> float:
    """What theta^3 adds to the stiffness of a motion of this rms, N m/rad; values of STIFFENS."""
    return float(3 * values[1] * deflection**2)
