"""The nearest positive semidefinite matrices in a quadratic metric, in closed form up to 2 x 2.

A symmetric 2 x 2 matrix ``[[m + x, y], [y, m - x]]`` is positive semidefinite exactly if
``m >= sqrt(x^2 + y^2)``: a second-order cone in three numbers u = (m, x, y). The point of it that
is nearest to c in a metric Q is c itself, the apex, or a point of the surface, where for
J = diag(1, -1, -1) and a multiplier l > 0

    Q (u - c) = l J u,   u^T J u = 0   =>   phi(l) = sum_i mu_i v_i^2 / (1 - l mu_i)^2 = 0

in the coordinates that make Q the identity and J diagonal (mu). phi is monotonic between its
poles, so that its root is found by halving. See S. Boyd and L. Vandenberghe, *Convex Optimization*
(2004), sections 2.2.3 and 8.1, for the cone and projections.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError

Place = Literal["inside", "surface", "apex"]

_J = np.diag([1.0, -1.0, -1.0])
#: Halvings of [0, 1]: a few more than the digits of a double.
_HALVINGS = 60
_SWEEPS = 20_000
_TOLERANCE = 1e-13


@dataclass(frozen=True)
class NearestMatrices:
    """Result of `nearest_semidefinite`.

    `u` (c s,): s numbers of each of the c matrices: (m, x, y), or the value of a 1 x 1 matrix.
    `places`: place of each matrix: positive definite, singular, or zero.
    """

    u: FloatArray
    places: tuple[Place, ...]


def nearest_semidefinite(metric: FloatArray, centre: FloatArray, size: int) -> NearestMatrices:
    """Minimise ``(u - c)^T Q (u - c)`` over c matrices that are all positive semidefinite.

    Cones that the free solution violates are imposed and the other matrices eliminated. If one of
    these then violates its cone, that is imposed too. With one cone imposed the solution is exact
    in closed form; with several, they are projected onto in turn.

    `centre` (c s,).
    `metric` (c s, c s): Q, symmetric positive definite; s = 3 for size 2, 1 for size 1.
    Raises InputError: another size, or a metric that is not positive definite.
    Raises EstimationError: the projections in turn do not settle.
    """
    if size not in (1, 2):
        raise InputError(f"matrices of size {size}", expected="1 or 2 for the closed form")
    if not np.linalg.eigvalsh(metric)[0] > 0:
        raise InputError("a metric that is not positive definite")
    s = 1 if size == 1 else 3
    count = len(centre) // s
    u, places = np.array(centre, dtype=float), ["inside"] * count
    imposed: list[int] = []
    while True:
        broken = [i for i in range(count) if i not in imposed and not _inside(u[s * i : s * i + s])]
        if not broken:
            return NearestMatrices(u, tuple(places))  # type: ignore[arg-type]
        imposed = sorted([*imposed, *broken])
        on = np.concatenate([np.arange(s * i, s * i + s) for i in imposed])
        off = np.setdiff1d(np.arange(len(centre)), on)
        # free matrices eliminated: Q_on - Q_on,off Q_off^-1 Q_off,on
        back = np.linalg.solve(metric[np.ix_(off, off)], metric[np.ix_(off, on)])
        reduced = metric[np.ix_(on, on)] - metric[np.ix_(on, off)] @ back
        u[on], imposed_places = _project_all(reduced, centre[on], s)
        u[off] = centre[off] - back @ (u[on] - centre[on])
        for i, place in zip(imposed, imposed_places, strict=True):
            places[i] = place


def _inside(u: FloatArray) -> bool:
    return bool(u[0] >= np.hypot(*u[1:])) if len(u) > 1 else bool(u[0] >= 0)


def _project_all(metric: FloatArray, centre: FloatArray, s: int) -> tuple[FloatArray, list[Place]]:
    """Nearest point with every block in its cone: exact for one block, iterative for several."""
    blocks = [slice(i, i + s) for i in range(0, len(centre), s)]
    if len(blocks) == 1:
        u, place = project_on_cone(metric, centre)
        return u, [place]
    u, places = centre.copy(), ["inside"] * len(blocks)
    size = float(centre @ metric @ centre)
    for _ in range(_SWEEPS):
        moved = 0.0
        for i, block in enumerate(blocks):
            own = metric[block, block]
            pull = metric[block] @ (u - centre) - own @ (u[block] - centre[block])
            new, places[i] = project_on_cone(own, centre[block] - np.linalg.solve(own, pull))
            step = new - u[block]
            moved += float(step @ own @ step)
            u[block] = new
        if moved <= _TOLERANCE**2 * size:
            return u, places  # type: ignore[return-value]
    raise EstimationError(f"positive semidefinite matrices did not settle in {_SWEEPS} sweeps")


def project_on_cone(metric: FloatArray, centre: FloatArray) -> tuple[FloatArray, Place]:
    """The point of one cone nearest to `centre` (3,) or (1,), and where it lies.

    `centre` (3,) or (1,).
    `metric` (3, 3) or (1, 1): symmetric positive definite.
    """
    if _inside(centre):
        return centre.copy(), "inside"
    # zero is nearest if the force -Q c towards the cone's outside is in the (self-dual) cone
    if len(centre) == 1 or _inside(-metric @ centre):
        return np.zeros(len(centre)), "apex"
    L = np.linalg.cholesky(metric)
    half = np.linalg.solve(L, _J)
    mu, R = np.linalg.eigh(np.linalg.solve(L, half.T))
    R = R * np.where(np.linalg.solve(L.T, R)[0] < 0, -1.0, 1.0)
    v = R.T @ (L.T @ centre)
    # u = L^-T R w, w_i = v_i / (1 - l mu_i); mu_2 > 0 belongs to the cone's axis
    w = _on_surface(mu / mu[2], v)
    u = np.linalg.solve(L.T, R @ w)
    u[0] = np.hypot(u[1], u[2])
    return u, "surface"


def _on_surface(mu: FloatArray, v: FloatArray) -> FloatArray:
    """Coordinates w of the surface's nearest point; mu (3,) scaled so that its largest is 1."""
    ahead = v[2] > 0
    v2, (a, b) = v * v, -mu[:2]
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        r = (low + high) / 2
        # ahead of the apex l = r in (0, 1); behind it l = 1/r in (1, inf)
        l_, axis = (r, 1 - r) if ahead else (1 / r, (1 - r) / r)
        across = a * v2[0] / (1 + a * l_) ** 2 + b * v2[1] / (1 + b * l_) ** 2
        # sign of phi, without the pole at r = 1
        low, high = (low, r) if v2[2] > axis**2 * across else (r, high)
    r = (low + high) / 2
    l_ = r if ahead else 1 / r
    w = np.array([v[0] / (1 + a * l_), v[1] / (1 + b * l_), 0.0])
    w[2] = np.sqrt(a * w[0] ** 2 + b * w[1] ** 2)
    return w
