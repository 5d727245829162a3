"""Moment arms tabulated on a grid of shoulder and elbow angles, interpolated by splines."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RectBivariateSpline
from scipy.sparse import csr_array, diags_array, eye_array, kron, vstack
from scipy.sparse.linalg import lsqr

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen_array
from armimpedance.core.delimited import Delimited, number_of, numbered_rows, opened_text
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.inputs import unchanged
from armimpedance.limb.arm.polynomial_paths import (
    STIFFNESS_PER_TENSION,
    MusclePaths,
    MuscularArm,
    check_angles,
    paths_of_table,
)

#: Fewest angles along a joint for a cubic spline.
LEAST_ANGLES: Final = 4
#: Largest misfit of a consistent length as a share of the arms. Stiffness is proportional to their
#: square, and an error of 20 % equals that of the source's missing force term at 30 N. White errors
#: of 1 mm in arms of 40 mm give 2 %.
LARGEST_INCONSISTENCY: Final = 0.1
_JOINTS: Final = ("shoulder", "elbow")


@dataclass(frozen=True)
class TablePaths(FrozenRecord):
    """m muscles over shoulder and elbow, cubic splines through a table.

    `muscles` (m,) tuple of str.
    `shoulder`, `elbow` (a,), (b,): the grid's angles, increasing, rad.
    `arms` (m, a, b, 2): ``G = dL/dq`` at the grid, m.
    `inconsistency` (m,): rms misfit (m) between the arms and the gradient of the best length.
    Raises InputError: fewer than 4 angles along a joint, or moment arms that are not the gradient
    of a length.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    shoulder: Annotated[FloatArray, "a"]
    elbow: Annotated[FloatArray, "b"]
    arms: Annotated[FloatArray, "m a b 2"]
    inconsistency: FloatArray = field(init=False)
    # not annotated as a tuple: it is set after the other fields are checked
    _splines: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in _JOINTS:
            angles = getattr(self, name)
            if len(angles) < LEAST_ANGLES or not (np.diff(angles) > 0).all():
                raise InputError(
                    f"{len(angles)} angles of the {name}",
                    expected=f"at least {LEAST_ANGLES}, increasing",
                )
        put = object.__setattr__
        splines = tuple(
            tuple(RectBivariateSpline(self.shoulder, self.elbow, arm[..., j]) for j in (0, 1))
            for arm in self.arms
        )
        put(self, "_splines", splines)
        inconsistency = [_inconsistency(self.shoulder, self.elbow, pair) for pair in splines]
        put(
            self,
            "inconsistency",
            frozen_array(inconsistency, "inconsistency", (len(self.muscles),)),
        )
        self._check_consistent()

    def _check_consistent(self) -> None:
        sizes = np.sqrt(np.mean(np.sum(self.arms**2, axis=-1), axis=(1, 2)))
        for name, error, size in zip(self.muscles, self.inconsistency, sizes, strict=True):
            if error > LARGEST_INCONSISTENCY * size:
                raise InputError(
                    f"muscle {name}: no length has these moment arms (they miss by "
                    f"{1e3 * error:.2g} mm rms of {1e3 * size:.2g} mm: dG_shoulder/dq_elbow and "
                    "dG_elbow/dq_shoulder differ)",
                    expected=f"at most {100 * LARGEST_INCONSISTENCY:g} %",
                )

    @property
    def joints(self) -> int:
        """Number of joints, 2."""
        return 2

    @property
    def angle_range(self) -> FloatArray:
        """First and last angle of the table, (2, 2), rad."""
        return np.array([[a[0], a[-1]] for a in (self.shoulder, self.elbow)])

    def moment_arms(self, q: ArrayLike) -> FloatArray:
        """Moment arms ``G = dL/dq``, m, (..., m, 2).

        Raises InputError: a posture outside of the table.
        """
        angles = self._inside(q)
        arms = [[spline.ev(*angles) for spline in pair] for pair in self._splines]
        return np.moveaxis(np.array(arms), (0, 1), (-2, -1))

    def curvature(self, q: ArrayLike) -> FloatArray:
        """Second derivatives ``d2L/dq2``, m, (..., m, 2, 2): symmetric part of the splines' slopes.

        Raises InputError: a posture outside of the table.
        """
        angles = self._inside(q)
        slopes = [
            [[spline.ev(*angles, dx=1 - j, dy=j) for j in (0, 1)] for spline in pair]
            for pair in self._splines
        ]
        # dG_i/dq_j, (..., m, i, j)
        C = np.moveaxis(np.array(slopes), (0, 1, 2), (-3, -2, -1))
        return (C + np.swapaxes(C, -1, -2)) / 2

    def _inside(self, q: ArrayLike) -> tuple[FloatArray, FloatArray]:
        angles = check_angles(q, 2)
        for j, (low, high) in enumerate(self.angle_range):
            outside = (angles[..., j] < low - 1e-9) | (angles[..., j] > high + 1e-9)
            if outside.any():
                raise InputError(
                    f"{_JOINTS[j]} at {np.rad2deg(angles[..., j][outside].flat[0]):.1f} degrees is "
                    "outside of the table of moment arms",
                    expected=f"{np.rad2deg(low):.1f} to {np.rad2deg(high):.1f} degrees",
                )
        return angles[..., 0], angles[..., 1]


def _inconsistency(
    shoulder: FloatArray, elbow: FloatArray, splines: tuple[RectBivariateSpline, ...]
) -> float:
    """Rms misfit (m) between a muscle's arms and the gradient of the best length at the nodes.

    Along each edge of the grid the length changes by the integral of the arm; around a mesh the
    four changes must cancel. The best length is that of least squares over the edges, equally
    weighted.
    """
    a, b = len(shoulder), len(elbow)
    across = _mean_arms(lambda x: splines[0](x, elbow), shoulder)
    along = _mean_arms(lambda x: splines[1](shoulder, x).T, elbow).T
    # W (edges, nodes) L (nodes,) = mean arms (edges,)
    W = vstack([kron(_slopes(shoulder), eye_array(b)), kron(eye_array(a), _slopes(elbow))])
    means = np.concatenate([across.ravel(), along.ravel()])
    length = lsqr(csr_array(W), means, atol=1e-12, btol=1e-12)[0]
    return float(np.sqrt(np.mean((W @ length - means) ** 2)))


def _mean_arms(arm: Callable[[FloatArray], FloatArray], nodes: FloatArray) -> FloatArray:
    """Mean arm between neighbouring nodes, by Simpson's rule, which is exact for a cubic spline."""
    at, between = arm(nodes), arm((nodes[:-1] + nodes[1:]) / 2)
    return (at[:-1] + 4 * between + at[1:]) / 6


def _slopes(nodes: FloatArray) -> csr_array:
    """Operator of the slopes between neighbouring nodes, (nodes - 1, nodes)."""
    inverse = 1 / np.diff(nodes)
    shape = (len(nodes) - 1, len(nodes))
    return csr_array(diags_array(np.stack([-inverse, inverse]), offsets=[0, 1], shape=shape))


# A lab's table of moment arms as CSV.
#
# Columns: ``muscle, q_shoulder_rad, q_elbow_rad, G_shoulder_m, G_elbow_m`` (``G = dL/dq``, positive
# if the muscle lengthens), every muscle at every posture of a rectangular grid of at least 4 x 4
# angles. An arm of n joints has ``q_1_rad`` to ``q_n_rad`` and ``G_1_m`` to ``G_n_m``, at any
# postures (`posture_table`). Optional ``max_tension_N`` (one value for each muscle) and
# ``stiffness_per_tension_per_m`` (one value). Lines that start with # are comments.

ANGLES: Final = ("q_shoulder_rad", "q_elbow_rad")
ARMS: Final = ("G_shoulder_m", "G_elbow_m")
TENSION: Final = "max_tension_N"
PER_TENSION: Final = "stiffness_per_tension_per_m"
#: Maximum tension of all muscles if the table has none (N).
EQUAL_TENSION_N: Final = 1000.0
#: Longest moment arm of a human muscle; a longer one is in mm or cm.
_LONGEST_ARM_M: Final = 0.2
#: Angles of a grid that differ by less are the same, written with other digits.
_SAME_RAD: Final = 1e-5


@dataclass(frozen=True)
class _Row:
    """One line of the table: its number in an editor, the muscle, the numbers by column."""

    line: int
    muscle: str
    numbers: Mapping[str, float]


@dataclass(frozen=True)
class _Table:
    """The lines of a file, and errors that refer to them."""

    file: Path
    rows: tuple[_Row, ...]
    angles: tuple[str, ...] = ANGLES
    arms: tuple[str, ...] = ARMS

    def numbers(self, muscle: str, columns: tuple[str, ...]) -> FloatArray:
        """Values (P, n) of the stated columns in a muscle's rows."""
        mine = (row.numbers for row in self.rows if row.muscle == muscle)
        return np.array([[numbers[name] for name in columns] for numbers in mine])

    def wrong(self, row: _Row, problem: str, column: str, expected: str) -> InputError:
        return InputError(problem, file=self.file, row=row.line, column=column, expected=expected)


def read_moment_arm_table(path: str | Path) -> MuscularArm:
    """Read a table of moment arms.

    Raises InputError: a value is missing or wrong (the message names file, row and column), or the
    moment arms are not the gradient of a length.
    """
    table = _read(Path(path))
    muscles = tuple(dict.fromkeys(row.muscle for row in table.rows))
    try:
        paths, limits = _paths(table, muscles)
    except NotIdentifiableError as error:
        raise InputError(str(error), file=path, expected="more postures, off one line") from error
    except InputError as error:
        if error.file is not None:
            raise
        raise InputError(error.problem, file=path, expected=error.expected) from error
    tensions = [_constant(table, TENSION, muscle) for muscle in muscles]
    per_tension = _constant(table, PER_TENSION)
    notes = [f"moment arms from {Path(path).name}"]
    if None in tensions:
        notes.append(f"all muscles taken as equally strong ({EQUAL_TENSION_N:g} N)")
    if per_tension is None:
        notes.append(f"stiffness per tension {STIFFNESS_PER_TENSION:g}/m after Selen et al. 2009")
    return MuscularArm(
        name=Path(path).stem,
        paths=paths,
        max_tension=np.array([EQUAL_TENSION_N if t is None else t for t in tensions]),
        stiffness_per_tension=per_tension or STIFFNESS_PER_TENSION,
        angle_range=limits,
        source="; ".join(notes),
    )


def _paths(table: _Table, muscles: tuple[str, ...]) -> tuple[MusclePaths, FloatArray]:
    """Paths of the muscles, and the range (n, 2) of each angle for which they are valid, rad."""
    if table.angles == ANGLES:
        shoulder, elbow = (_grid_angles(table, column) for column in ANGLES)
        planar = TablePaths(muscles, shoulder, elbow, _on_grid(table, muscles, shoulder, elbow))
        return planar, planar.angle_range
    q = [table.numbers(muscle, table.angles) for muscle in muscles]
    spatial = paths_of_table(muscles, q, [table.numbers(m, table.arms) for m in muscles])
    return spatial, spatial.box


_LAYOUT: Final = Delimited(comment="#", blank=True)


def _read(file: Path) -> _Table:
    if not file.is_file():
        raise InputError("no such file", file=file, expected="a table of moment arms")
    with (
        unchanged(file),
        opened_text(file, errors="replace") as stream,
    ):
        rows_of = numbered_rows(stream, file, _LAYOUT)
        lines = ((number, [cell.strip() for cell in cells]) for number, cells in rows_of)
        first = next(lines, None)
        if first is None:
            raise InputError("is empty", file=file, expected=", ".join(("muscle", *ANGLES, *ARMS)))
        angles, arms = _columns(first[1])
        names = _header(file, *first, ("muscle", *angles, *arms))
        rows = tuple(_row(file, number, names, cells, angles, arms) for number, cells in lines)
    if not rows:
        raise InputError("no rows under the header", file=file, expected="one row per posture")
    return _Table(file, rows, angles, arms)


def _columns(header: list[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the columns of angles and moment arms: of shoulder and elbow, or numbered."""
    if ANGLES[0] in header or "q_1_rad" not in header:
        return ANGLES, ARMS
    joints = next(j for j in range(1, len(header) + 2) if f"q_{j}_rad" not in header)
    n = range(1, joints)
    return tuple(f"q_{j}_rad" for j in n), tuple(f"G_{j}_m" for j in n)


def _header(file: Path, line: int, names: list[str], needed: tuple[str, ...]) -> list[str]:
    for name in needed:
        if name not in names:
            present = ", ".join(names)
            raise InputError(
                "no such column", file=file, row=line, column=name, expected=f"it beside {present}"
            )
    for name in names:
        if names.count(name) > 1:
            raise InputError("appears twice in the header", file=file, row=line, column=name)
    return names


def _row(
    file: Path,
    line: int,
    names: list[str],
    cells: list[str],
    angles: tuple[str, ...],
    arms: tuple[str, ...],
) -> _Row:
    if len(cells) != len(names):
        expected = f"{len(names)}, as in the header"
        raise InputError(f"{len(cells)} cells", file=file, row=line, expected=expected)
    by_name = dict(zip(names, cells, strict=True))
    if not by_name["muscle"]:
        raise InputError("empty", file=file, row=line, column="muscle", expected="a name")
    limits = {**dict.fromkeys(angles, 2 * math.pi), **dict.fromkeys(arms, _LONGEST_ARM_M)}
    limits |= {name: math.inf for name in (TENSION, PER_TENSION) if name in by_name}
    numbers = {
        name: _number(file, line, name, by_name[name], limit) for name, limit in limits.items()
    }
    return _Row(line, by_name["muscle"], numbers)


def _number(file: Path, line: int, column: str, text: str, limit: float) -> float:
    unit = column.rpartition("_")[2]
    if column in (TENSION, PER_TENSION):
        expected = "a positive number"
    else:
        expected = f"a number in {unit} of at most {limit:.3g}"
    value = number_of(text)
    signed = column not in (TENSION, PER_TENSION)
    finite = value is not None and math.isfinite(value)
    if value is None or not (finite and abs(value) <= limit and (signed or value > 0)):
        problem = repr(text[:40]) if text else "empty cell"
        raise InputError(problem, file=file, row=line, column=column, expected=expected)
    return value


def _grid_angles(table: _Table, column: str) -> FloatArray:
    """Distinct angles of a column, increasing."""
    angles = np.unique([row.numbers[column] for row in table.rows])
    is_distinct = np.concatenate([[True], np.diff(angles) > _SAME_RAD])
    return np.asarray(angles[is_distinct])


def _on_grid(
    table: _Table, muscles: tuple[str, ...], shoulder: FloatArray, elbow: FloatArray
) -> FloatArray:
    """Moment arms (m, a, b, 2), every cell filled once."""
    arms = np.full((len(muscles), len(shoulder), len(elbow), 2), np.nan)
    for row in table.rows:
        q = [row.numbers[column] for column in ANGLES]
        i, j = (int(np.abs(g - a).argmin()) for g, a in zip((shoulder, elbow), q, strict=True))
        cell = arms[muscles.index(row.muscle), i, j]
        if np.isfinite(cell).any():
            raise table.wrong(
                row, f"{row.muscle} at this posture again", ANGLES[0], "each posture once"
            )
        cell[:] = [row.numbers[column] for column in ARMS]
    missing = np.argwhere(np.isnan(arms[..., 0]))
    if len(missing):
        n, i, j = missing[0]
        raise InputError(
            f"no row for {muscles[n]} at q_shoulder_rad {shoulder[i]:.6g}, q_elbow_rad "
            f"{elbow[j]:.6g} ({len(missing)} of {arms.shape[0] * len(shoulder) * len(elbow)} rows "
            "are missing)",
            file=table.file,
            column=ANGLES[0],
            expected="all muscles at all pairs of the angles",
        )
    return arms


def _constant(table: _Table, column: str, muscle: str | None = None) -> float | None:
    """Value of a column that must be the same in a muscle's rows, or in all; None: no column."""
    rows = [row for row in table.rows if muscle in (None, row.muscle)]
    if column not in rows[0].numbers:
        return None
    for row in rows:
        if row.numbers[column] != rows[0].numbers[column]:
            whose = "all muscles" if muscle is None else muscle
            raise table.wrong(
                row,
                f"{row.numbers[column]:g} after {rows[0].numbers[column]:g}",
                column,
                f"one value for {whose}",
            )
    return rows[0].numbers[column]
