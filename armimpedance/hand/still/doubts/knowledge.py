"""Information of trials about M, B, K and the sizes of the departures: it adds up over trials.

With theta = M, B, K row by row (p,) and k the sizes of the departures (c,), the information of a
trial is

    N_t = [[W^T V W, W^T V z], [z^T V W, z^T V z]]   (p + c, p + c),

so that trials that are only planned can be added to those that were recorded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.records import Window
from armimpedance.hand.still.bound import inverse_information
from armimpedance.hand.still.modal import ModalEquation


@dataclass(frozen=True)
class Peaks:
    """Units of the departures' sizes: median peaks of displacement (m, rad) and force."""

    way: float
    force: float

    @classmethod
    def of(cls, window: Window) -> Peaks:
        """Compute the peaks from a window's usable trials."""
        used = window.usable
        x = window.position[used] - window.position_at_onset[used][:, None]
        pushes = window.force[used] - window.force_at_onset[used][:, None]
        return cls(
            way=float(np.sqrt(np.median((x**2).sum(axis=2).max(axis=1)))),
            force=float(np.median(np.linalg.norm(pushes, axis=2).max(axis=1))),
        )


@dataclass(frozen=True, eq=False)
class DepartureProducts:
    """Products of c columns z with the weight V, for every trial.

    `zVW`, `ZVz` (T, c, p): with the regressors W and with the instruments Z. `zVz` (T, c, c), `zVy`
    (T, c).
    """

    names: tuple[str, ...]
    zVW: FloatArray
    ZVz: FloatArray
    zVz: FloatArray
    zVy: FloatArray


def products_of(
    equation: ModalEquation,
    weight: FloatArray,
    instruments: FloatArray | None,
    columns: Mapping[str, FloatArray],
) -> DepartureProducts:
    """Products of all columns z (T, d, n) at once; `weight` (d n, d n) is V."""
    T, d, n = equation.force.shape
    z = np.stack([column.reshape(T, d * n) for column in columns.values()], axis=1)
    Vz = z @ weight
    products = _against(equation.regressors, Vz, d)
    return DepartureProducts(
        names=tuple(columns),
        zVW=products,
        ZVz=products if instruments is None else _against(instruments, Vz, d),
        zVz=Vz @ z.mT,
        zVy=(Vz @ equation.force.reshape(T, -1, 1))[..., 0],
    )


def _against(motion: FloatArray, Vz: FloatArray, d: int) -> FloatArray:
    """``W_t^T V z_t`` (T, c, p), W_t made from motion (T, r d, n)."""
    T, c, _ = Vz.shape
    rd, n = motion.shape[1:]
    # [t, (m k), (c i)] = sum_n motion[t, (m k), n] Vz[t, (c i), n]; parameters are (m, i, k)
    products = (motion @ Vz.reshape(T, c * d, n).mT).reshape(T, rd // d, d, c, d)
    return products.transpose(0, 3, 1, 4, 2).reshape(T, c, rd * d)


def information_by_trial(A: FloatArray, products: DepartureProducts) -> FloatArray:
    """N_t of every trial, (T, p + c, p + c); `A` (T, p, p) is ``W_t^T V W_t``, symmetric."""
    T, p, _ = A.shape
    q = p + len(products.names)
    total = np.empty((T, q, q))
    total[:, :p, :p] = A
    total[:, p:, :p] = products.zVW
    total[:, :p, p:] = total[:, p:, :p].mT
    total[:, p:, p:] = products.zVz
    return total


@dataclass(frozen=True, eq=False)
class Knowledge(FrozenRecord):
    """Information of trials about M, B, K and the sizes of the departures.

    `information` (p + c, p + c): sum over trials of N_t.
    `names`: names of the c columns.
    `trials`: number of trials; need not be whole in a plan.
    `peaks`: units of the departures' sizes.
    """

    information: Annotated[FloatArray, "q q"]
    names: tuple[str, ...]
    trials: float
    peaks: Peaks

    def __add__(self, other: Knowledge) -> Knowledge:
        """Information of both together."""
        return replace(
            self,
            information=self.information + other.information,
            trials=self.trials + other.trials,
        )

    def ordered(self, names: tuple[str, ...]) -> Knowledge:
        """Restrict to these columns, in this order."""
        p = self.parameters
        at = [*range(p), *(p + self.names.index(name) for name in names)]
        return replace(self, information=self.information[np.ix_(at, at)], names=names)

    def times(self, factor: float) -> Knowledge:
        """Information of a multiple of the trials."""
        return replace(self, information=factor * self.information, trials=factor * self.trials)

    @property
    def parameters(self) -> int:
        """Number p of M, B and K's elements."""
        return len(self.information) - len(self.names)

    @cached_property
    def covariance(self) -> FloatArray:
        """Least covariance (p, p) of M, B and K without departures."""
        p = self.parameters
        return inverse_information(self.information[:p, :p])

    @cached_property
    def shifts(self) -> FloatArray:
        """Error of M, B and K for one unit of each departure, (c, p)."""
        p = self.parameters
        # A (p, p) theta_plain = b = A theta + W^T V z k
        return np.asarray(self.information[p:, :p] @ self.covariance)

    @cached_property
    def own(self) -> FloatArray:
        """Information (c, c) about the sizes of the departures, with M, B and K unknown."""
        p = self.parameters
        left = self.information[p:, p:] - self.shifts @ self.information[:p, p:]
        return np.asarray((left + left.T) / 2)

    @property
    def expected(self) -> FloatArray:
        """Standard error (c,) of the size of each departure, with M, B and K estimated too."""
        return np.asarray(1 / np.sqrt(np.maximum(np.diag(self.own), 1e-300)))
