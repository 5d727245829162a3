"""Numbers of the hand's sessions, as rows: estimated, or drawn from their distribution."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtrit

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import UNITS, parameter_names
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.records import Window
from armimpedance.hand.ellipses import FIELDS, Ellipse, ellipse, ellipse_of, half_turn
from armimpedance.hand.still import METHODS, Group, Options, estimate_window
from armimpedance.lab.simulate_study.fields import Field, Settings, one_of
from armimpedance.lab.simulate_study.rig import COLUMNS, Numbers, Shortcut, StudyQuantity
from armimpedance.numerics.regression import t_interval

_UNITS: Final = UNITS["hand"]
QUANTITIES: Final = (
    *(StudyQuantity(name, _UNITS[name[0]]) for name in parameter_names(2)),
    *(
        quantity
        for symbol in "MBK"
        for quantity in (
            StudyQuantity(f"size_{symbol}", f"({_UNITS[symbol]})^2", "ratio"),
            StudyQuantity(f"orientation_{symbol}", "rad", "axis"),
            StudyQuantity(f"shape_{symbol}", "1", "share"),
        )
    ),
)
#: Elements (12), roots of the covariances of M, B, K (3 x 10), log dof, line shoulder -> hand.
EXTRAS: Final = 44
_LOWER: Final = np.tril_indices(4)
_DIAGONAL: Final = np.flatnonzero(_LOWER[0] == _LOWER[1])


def numbers_of(estimate: ImpedanceEstimate, truth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Numbers (21, 7) and extras (44,) of one estimate whose truth is known, (3, 2, 2)."""
    values = np.full((len(QUANTITIES), len(COLUMNS)), np.nan)
    sd = estimate.sd.ravel()
    low, high = t_interval(estimate.parameters, sd, estimate.dof).T
    bound = np.full(12, np.nan)
    if estimate.bound is not None:
        bound = np.sqrt(np.diag(estimate.bound))
    dof = np.full(12, estimate.dof)
    values[:12] = np.column_stack([estimate.parameters, low, high, sd, dof, truth.ravel(), bound])
    angle = np.nan
    for block, which in enumerate(FIELDS):
        shown_ellipse = ellipse_of(estimate, which)
        if shown_ellipse is None:
            continue
        angle = shown_ellipse.reference_angle_rad
        true = ellipse(truth[block], reference_angle_rad=angle)
        values[12 + 3 * block : 15 + 3 * block] = _ellipse_rows(shown_ellipse, true)
    extras = np.concatenate(
        [estimate.parameters, *_roots(estimate.covariance), [np.log(estimate.dof), angle]]
    )
    return values, extras


def _ellipse_rows(estimated: Ellipse, true: Ellipse) -> FloatArray:
    """Size, orientation and shape, (3, 7)."""
    covariance = np.asarray(estimated.covariance)
    return np.column_stack(
        [
            [estimated.size, estimated.orientation_rad, estimated.shape],
            estimated.interval(),
            np.sqrt(np.diag(covariance)),
            np.full(3, estimated.dof),
            [true.size, true.orientation_rad, true.shape],
            np.full(3, np.nan),
        ]
    )


def _roots(covariance: FloatArray) -> list[FloatArray]:
    """Cholesky factors of the 4 x 4 covariances of M, B and K, logarithms on their diagonals."""
    roots = []
    for block in range(3):
        part = covariance[4 * block : 4 * block + 4, 4 * block : 4 * block + 4]
        try:
            root = np.asarray(np.linalg.cholesky(part)[_LOWER], dtype=float)
            root[_DIAGONAL] = np.log(root[_DIAGONAL])
        except np.linalg.LinAlgError:
            root = np.full(10, np.nan)
        roots.append(root)
    return roots


# Numbers of the hand's sessions from what is drawn of them, many at once.
#
# Drawn are the elements of M, B, K (12), and of the covariance of each of the three matrices the
# Cholesky factor with logarithms on its diagonal (10 each): the standard errors and all that an
# ellipse's interval takes. The logarithms keep variances positive and are closer to normal than
# variances are; drawn jointly with the elements, an estimate that is large for a large error stays
# so. Then the intervals are built as the estimate itself builds them (`hand.ellipses.geometry`).

_LARGEST_EXPONENT: Final = 300.0
_LOW: Final = tuple(zip(*np.tril_indices(4), strict=True))


def values_of(extras: FloatArray, truth: FloatArray, bound: FloatArray) -> FloatArray:
    """Numbers (n, 21, 7) of sessions.

    `truth`, `bound` (21,).
    `extras` (n, 44): as `hand_numbers.numbers_of` has them.
    Returns: (n, 21, 7): nan where a matrix has no ellipse.
    """
    # each number's column lies in one piece, which is what the arithmetic runs along
    values = np.empty((len(QUANTITIES), len(COLUMNS), len(extras)))
    drawn = np.ascontiguousarray(extras.T)
    dof = np.exp(drawn[42])
    steady = bool(np.ptp(dof) < 1e-9 * dof[0])
    t = stdtrit(dof[0] if steady else dof, 0.975)
    for block in range(3):
        elements = drawn[4 * block : 4 * block + 4]
        root = _root(drawn[12 + 10 * block : 22 + 10 * block])
        for j in range(4):
            sd = np.sqrt(sum(root[j, k] ** 2 for k in range(j + 1)))
            low, high = elements[j] - t * sd, elements[j] + t * sd
            values[4 * block + j, :4] = elements[j], low, high, sd
        with np.errstate(all="ignore"):
            rows = _ellipse(elements, root, t, dof, drawn[43])
        values[12 + 3 * block : 15 + 3 * block, :4] = rows
    values[:, 4] = dof
    values[:, 5] = truth[:, None]
    values[:, 6] = bound[:, None]
    return values.transpose(2, 0, 1)


def _root(flat: FloatArray) -> dict[tuple[int, int], FloatArray]:
    """(row, column) -> element of the Cholesky factor, (n,)."""
    return {
        (int(i), int(j)): np.exp(flat[n]) if i == j else flat[n] for n, (i, j) in enumerate(_LOW)
    }


def _ellipse(
    elements: FloatArray,
    root: dict[tuple[int, int], FloatArray],
    t: FloatArray,
    dof: FloatArray,
    reference: FloatArray,
) -> FloatArray:
    """Estimate, limits and sd of size, orientation and shape, (3, 4, n)."""
    a, c, b = elements[0], (elements[1] + elements[2]) / 2, elements[3]
    mean, x, y = (a + b) / 2, (a - b) / 2, c
    radius = np.hypot(x, y)
    major, minor = mean + radius, mean - radius
    # rows of the roots of the covariance of mean, x and y: (3, 4, n)
    parts = _parts(root)
    s = {(i, j): (parts[i] * parts[j]).sum(axis=0) for i in range(3) for j in range(i, 3)}
    size, shape = np.pi * major * minor, minor / major
    rows = np.empty((3, 4, len(a)))
    rows[0] = _size(size, (mean, x, y), s, t)
    circular = _circular(x, y, s, dof)
    rows[1] = _orientation((x, y), radius, s, t, circular, reference)
    rows[2] = _shape(shape, major, (mean, x, y, radius), s, t, circular)
    rows[:, :, ~(minor > 1e-13 * mean)] = np.nan
    return rows


def _parts(root: dict[tuple[int, int], FloatArray]) -> FloatArray:
    zero = np.zeros_like(root[0, 0])
    full = np.array([[root.get((i, j), zero) for j in range(4)] for i in range(4)])
    middle = (full[1] + full[2]) / 2
    return np.array([(full[0] + full[3]) / 2, (full[0] - full[3]) / 2, middle])


Moments = dict[tuple[int, int], FloatArray]


def _variance(slope: tuple[FloatArray, FloatArray, FloatArray], s: Moments) -> FloatArray:
    """Variance of a sum of mean, x and y with these weights."""
    m, x, y = slope
    own = m * m * s[0, 0] + x * x * s[1, 1] + y * y * s[2, 2]
    return np.asarray(own + 2 * (m * x * s[0, 1] + m * y * s[0, 2] + x * y * s[1, 2]))


def _size(
    size: FloatArray, at: tuple[FloatArray, FloatArray, FloatArray], s: Moments, t: FloatArray
) -> FloatArray:
    """size = pi (mean^2 - x^2 - y^2)."""
    mean, x, y = at
    sd = 2 * np.pi * np.sqrt(_variance((mean, -x, -y), s))
    factor = np.exp(np.minimum(t * sd / size, _LARGEST_EXPONENT))
    return np.array([size, size / factor, size * factor, sd])


def _circular(x: FloatArray, y: FloatArray, s: Moments, dof: FloatArray) -> FloatArray:
    """True where a circle lies in the joint confidence region of x and y."""
    limit = -2 * np.log1p(-0.95)
    limit = np.where(np.isfinite(dof), dof * np.expm1(limit / dof), limit)
    xx, xy, yy = x * x - limit * s[1, 1], x * y - limit * s[1, 2], y * y - limit * s[2, 2]
    return np.asarray((xx + yy) / 2 + np.hypot((xx - yy) / 2, xy) <= 0)


def _orientation(
    at: tuple[FloatArray, FloatArray],
    radius: FloatArray,
    s: Moments,
    t: FloatArray,
    circular: FloatArray,
    reference: FloatArray,
) -> FloatArray:
    x, y = at
    xx, xy, yy = x * x - t**2 * s[1, 1], x * y - t**2 * s[1, 2], y * y - t**2 * s[2, 2]
    middle, apart = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    half = np.arctan(np.sqrt(np.maximum(apart - middle, 0) / (middle + apart))) / 2
    # the larger eigenvector's direction, on the side of (x, y)
    turn = np.arctan2(xy, (xx - yy) / 2) / 2
    turn = np.where(np.cos(turn) * x + np.sin(turn) * y < 0, turn + np.pi, turn)
    axis = np.arctan2(y, x) / 2
    angle = half_turn(axis - reference)
    centre = angle + half_turn(turn / 2 - axis)
    low = np.where(circular, -np.pi / 2, centre - half)
    high = np.where(circular, np.pi / 2, centre + half)
    slope = (np.zeros_like(x), -y / (2 * radius**2), x / (2 * radius**2))
    return np.array([angle, low, high, np.sqrt(_variance(slope, s))])


def _shape(
    shape: FloatArray,
    major: FloatArray,
    at: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    s: Moments,
    t: FloatArray,
    circular: FloatArray,
) -> FloatArray:
    """shape = (mean - radius)/(mean + radius)."""
    mean, x, y, radius = at
    rate = 2 / major**2
    slope = (rate * radius, -rate * mean * x / radius, -rate * mean * y / radius)
    sd = np.sqrt(_variance(slope, s))
    reach = t * sd / shape
    high = np.where(circular, 1.0, shape * np.exp(np.minimum(reach, -np.log(shape))))
    return np.array([shape, shape * np.exp(-reach), high, sd])


SHORTCUT: Final = Shortcut(values_of)

# From windows of the hand to numbers: what the rigs `hand` and `linear` share.

_COVARIANCES: Final = ("cr3", "replicates", "cr1", "bootstrap")
#: The settings that only estimate.
ESTIMATOR: Final = (
    Field("method", METHODS.default, one_of(lambda: METHODS.names), simulated=False),
    Field("covariance", "cr3", one_of(lambda: _COVARIANCES), simulated=False),
)


@dataclass(frozen=True)
class PreparedWindows:
    """The windows of one condition, one for each session, and their truth (3, 2, 2)."""

    windows: list[Window]
    group: Group
    truth: FloatArray


def estimate_all(settings: Settings, made: list[PreparedWindows]) -> Numbers:
    """Every session of every condition; what fails is nan, and its reason counted."""
    method, covariance = str(settings["method"]), str(settings["covariance"])
    options = Options(method, covariance, bound=False)  # type: ignore[arg-type]
    sessions = len(made[0].windows)
    values = np.full((len(made), sessions, len(QUANTITIES), len(COLUMNS)), np.nan)
    extras = np.full((len(made), sessions, EXTRAS), np.nan)
    problems: Counter[str] = Counter()
    for c, one in enumerate(made):
        for s, window in enumerate(one.windows):
            try:
                result = estimate_window(window, one.group, options)
            except ArmImpedanceError as error:
                problems[str(error)] += 1
                continue
            values[c, s], extras[c, s] = numbers_of(result, one.truth)
    return Numbers(values, extras, dict(problems))


def shortcut() -> Shortcut:
    """The shortcut by which estimates at the hand are drawn."""
    pass

    return SHORTCUT
