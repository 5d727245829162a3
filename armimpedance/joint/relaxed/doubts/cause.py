"""A cause that makes a passive joint move unlike the model, and what is asked about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import chdtri

from armimpedance.joint.relaxed.doubts.evidence import RowEvidence, WhiteFit
from armimpedance.joint.relaxed.equations import Terms

#: Chance at which a cause is named on data that have none.
LEVEL: Final = 2e-4
#: A departure that a check with this level sees in half of the cases, in standard errors.
SEEN: Final = 3.7


@dataclass(frozen=True)
class Cause:
    """A cause and what it explains.

    `gain`: of twice the log-likelihood, less `price` times `parameters` where causes are compared.
    `says`: what it would be, and what to do.
    `fine`: what is said where it is not needed.
    `fit`, `alone`: with and without slow torque beside it.
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
        """Whether it is needed, were it the only one."""
        return self.gain > float(chdtri(self.parameters, LEVEL))

    @property
    def worth(self) -> float:
        """The gain less what parameters gain by chance."""
        return self.gain - self.parameters * self.price


@dataclass(frozen=True)
class Inquiry:
    """The evidence, and its fit by the model as it is."""

    terms: Terms
    evidence: RowEvidence
    base: WhiteFit
    alone: WhiteFit

    @property
    def price(self) -> float:
        """Of a parameter."""
        return float(np.log(self.evidence.count))

    def ask(
        self, columns: Sequence[str] = (), known: Mapping[str, float] | None = None
    ) -> tuple[WhiteFit, WhiteFit, float]:
        """The fits with these columns too, with and without slow torque, and the gain.

        `known`: columns that are there too, with their size.
        """
        every = (*self.terms.columns, *columns)
        fit = self.evidence.fit(every, known=known)
        gain = self.base.deviance - fit.deviance
        return fit, self.evidence.fit(every, slow=False, known=known), gain
