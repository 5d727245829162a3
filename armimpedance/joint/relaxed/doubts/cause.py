"""A cause that makes a passive joint move unlike the model, and its comparison with the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import chdtri

from armimpedance.joint.relaxed.doubts.evidence import RowEvidence, WhiteFit
from armimpedance.joint.relaxed.equations import Terms

#: Significance level at which a cause is reported.
LEVEL: Final = 2e-4
#: Departure that is detected at this level in half of the cases, in standard errors.
SEEN: Final = 3.7


@dataclass(frozen=True)
class Cause:
    """A cause and its fit.

    `gain`: of twice the log likelihood; `price` times `parameters` is subtracted in comparisons.
    `says`: text of the cause, with advice.
    `fine`: text if it is not significant.
    `fit`, `alone`: fits with and without slow torque.
    """

    name: str
    gain: float
    parameters: int
    price: float
    says: str
    fine: str
    smallest: str
    fit: WhiteFit
    alone: WhiteFit

    @property
    def seen(self) -> bool:
        """True if it is significant as the only cause."""
        return self.gain > float(chdtri(self.parameters, LEVEL))

    @property
    def worth(self) -> float:
        """Gain less the expected gain of its parameters by chance."""
        return self.gain - self.parameters * self.price


@dataclass(frozen=True)
class Inquiry:
    """The evidence, and the fits of the model as it is."""

    terms: Terms
    evidence: RowEvidence
    base: WhiteFit
    alone: WhiteFit

    @property
    def price(self) -> float:
        """Penalty of a parameter."""
        return float(np.log(self.evidence.count))

    def ask(
        self, columns: Sequence[str] = (), known: Mapping[str, float] | None = None
    ) -> tuple[WhiteFit, WhiteFit, float]:
        """Fits with these further columns, with and without slow torque, and the gain.

        `known`: further columns of fixed size.
        """
        every = (*self.terms.columns, *columns)
        fit = self.evidence.fit(every, known=known)
        gain = self.base.deviance - fit.deviance
        return fit, self.evidence.fit(every, slow=False, known=known), gain
