"""Inertia, viscosity and stiffness of the hand or of joints, and whether a reflex is in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Final, Literal, overload

import numpy as np

from armimpedance.analyses.estimates import Estimates
from armimpedance.analyses.labelled import html_table
from armimpedance.analyses.named import as_columns, position_of
from armimpedance.analyses.sources import PathLike, naming, read_recording
from armimpedance.arrays import FrozenRecord
from armimpedance.conventions import group_name
from armimpedance.errors import InputError
from armimpedance.files import check_group_columns, write_table
from armimpedance.impedance import (
    METHODS,
    ClusteredKind,
    Options,
    ReflexVerdict,
    SideBySide,
    estimate as estimate_groups,
    reflex_guard,
    side_by_side,
)
from armimpedance.plots import plot_reflex
from armimpedance.records import Recording, Subject
from armimpedance.report import headline, methods_table, verdict_rows

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[int, int], None]
ForceBy = Literal["limb", "device"]

#: The name that stands for every method, side by side.
ALL: Final = "all"


def estimate(
    recording: Recording | PathLike,
    *,
    by: str | Sequence[str] = "condition",
    method: str | None = None,
    covariance: ClusteredKind = "cr3",
    seed: int = 0,
    workers: int = 1,
    band_hz: tuple[float, float] | None = None,
    force_by: ForceBy | None = None,
    progress: Progress | None = None,
) -> Estimates:
    """Estimate inertia, viscosity and stiffness of every group of trials.

    Parameters
    ----------
    recording : Recording or path
        Of the hand or of joints.
    by : str or sequence of str
        Columns of the trial table; trials alike in all of them form a group. Without any column
        all trials form one group.
    method : str, optional
        An estimator for disturbances that return, such as "weighted" (the default), "exact" or
        "paper"; "all" gives the estimates of every method that can run (see `estimate_all`).
    covariance : {"cr3", "replicates", "cr1", "bootstrap"}
        How intervals follow from the spread between trials: jackknife, within each direction,
        sandwich, or trials drawn with replacement.
    seed : int
        Seed of the bootstrap.
    workers : int
        Number of processes; the result is the same to the bit.
    band_hz : (low, high), optional
        Fitted band of a stochastic perturbation, Hz; default: 5 to 45.
    force_by : {"limb", "device"}, optional
        Whose force on the other a Kinarm's sensor holds.
    progress : function (done, all), optional
        Called after each group.

    Returns
    -------
    Estimates
        One estimate per group, in the order of the trial table.

    Raises
    ------
    InputError
        The recording cannot be read, a column or method is unknown, or an option has no effect on
        this kind of perturbation. The message names the file where a path was given.
    NotIdentifiableError
        The motion of a group does not determine its parameters.

    Examples
    --------
    >>> from armimpedance.analyses import estimate
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> hand = estimate(recording)
    >>> hand
    1 estimates
    cocontraction_10: weighted, 8 trials, K 417.4, 155.4 N/m
    >>> hand["cocontraction_10"].stiffness.unit
    'N/m'
    """
    if method == ALL:
        _refuse_band(band_hz)
        return estimate_all(
            recording,
            by=by,
            covariance=covariance,
            seed=seed,
            workers=workers,
            force_by=force_by,
            progress=progress,
        ).estimates
    with _opened(recording, by, seed, force_by) as (opened, columns):
        chosen: dict[str, Any] = {"covariance": covariance, "seed": seed}
        if opened.perturbation == "stochastic":
            _refuse_method(method)
            chosen |= {} if band_hz is None else {"band_hz": tuple(band_hz)}
        else:
            _refuse_band(band_hz)
            chosen["method"] = METHODS.default if method is None else method
        options = Options(**chosen)
        made = estimate_groups(
            opened, by=columns, options=options, progress=progress, workers=workers
        )
        return Estimates(tuple(made), opened.subject)


def estimate_all(
    recording: Recording | PathLike,
    *,
    by: str | Sequence[str] = "condition",
    covariance: ClusteredKind = "cr3",
    seed: int = 0,
    workers: int = 1,
    force_by: ForceBy | None = None,
    progress: Progress | None = None,
) -> ComparedMethods:
    """Estimate with every method, and say which of them differ by more than chance.

    Parameters
    ----------
    recording : Recording or path
        Of the hand or of joints, with disturbances that return.
    by, covariance, seed, workers, force_by, progress
        See `estimate`.

    Returns
    -------
    ComparedMethods

    Raises
    ------
    InputError
        As `estimate`; or the perturbation is stochastic, which has one estimator only.

    Examples
    --------
    >>> from armimpedance.analyses import estimate_all
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> compared = estimate_all(recording)
    >>> compared.estimates["cocontraction_10", "exact"].stiffness.axes
    ('x', 'y')
    """
    with _opened(recording, by, seed, force_by) as (opened, columns):
        options = Options(covariance=covariance, seed=seed)
        groups = side_by_side(
            opened, by=columns, options=options, progress=progress, workers=workers
        )
        return ComparedMethods(tuple(groups), options.method, opened.subject)


def reflex(
    recording: Recording | PathLike,
    *,
    by: str | Sequence[str] = "condition",
    delay_ms: float | None = None,
    seed: int = 0,
    force_by: ForceBy | None = None,
    progress: Progress | None = None,
) -> ReflexVerdicts:
    """Judge for every group of trials whether a reflex stands in its stiffness.

    Parameters
    ----------
    recording : Recording or path
        Of the hand or of joints, with disturbances that return.
    by : str or sequence of str
        Columns of the trial table; trials alike in all of them form a group.
    delay_ms : float, optional
        Delay of the reflex where it is known, for example from EMG; default: delays from 30 to
        120 ms are scanned.
    seed : int
        Seed of the random signs behind p.
    force_by : {"limb", "device"}, optional
        Whose force on the other a Kinarm's sensor holds.
    progress : function (done, all), optional
        Called after each group.

    Returns
    -------
    ReflexVerdicts
        One verdict per group, in the order of the trial table.

    Raises
    ------
    InputError
        The recording cannot be read, a column is missing, there are too few trials, the delay is
        out of range, or the perturbation is stochastic.
    NotIdentifiableError
        The motion of a group does not determine M, B and K.

    Examples
    --------
    >>> from armimpedance.analyses import reflex
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> verdicts = reflex(recording)
    >>> verdicts["cocontraction_10"].outcome in ("none", "contaminated", "unknown")
    True
    """
    delay_s = None if delay_ms is None else delay_ms / 1e3
    with _opened(recording, by, seed, force_by) as (opened, columns):
        made = reflex_guard(opened, by=columns, delay_s=delay_s, seed=seed, progress=progress)
        return ReflexVerdicts(tuple(made))


@contextmanager
def _opened(
    source: Recording | PathLike, by: str | Sequence[str], seed: int, force_by: ForceBy | None
) -> Iterator[tuple[Recording, tuple[str, ...]]]:
    """The recording and the columns of its groups; errors inside name its path."""
    columns = as_columns(by)
    check_group_columns(columns)
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")
    with naming(source):
        yield read_recording(source, force_by=force_by), columns


def _refuse_method(method: str | None) -> None:
    if method is not None:
        raise InputError(
            f"method {method!r}: stochastic perturbations have one estimator only",
            column="perturbation",
            expected="no method, or disturbances that return",
        )


def _refuse_band(band_hz: tuple[float, float] | None) -> None:
    if band_hz is not None:
        raise InputError(
            "a band has no effect on disturbances that return",
            column="perturbation",
            expected="no band, or a stochastic perturbation",
        )


@dataclass(frozen=True, repr=False, eq=False)
class ComparedMethods(FrozenRecord):
    """Every method on every group of trials.

    Attributes
    ----------
    groups : tuple of SideBySide
        What each method found in each group, and how far it lies from the reference.
    reference : str
        The method that the others are measured against.
    subject : Subject or None
    """

    groups: tuple[SideBySide, ...]
    reference: str
    subject: Subject | None = None

    @property
    def estimates(self) -> Estimates:
        """The estimates of the methods that ran, group by group."""
        return Estimates(tuple(e for side in self.groups for e in side.estimates), self.subject)

    def to_frame(self) -> pd.DataFrame:
        """One row per group and method: distance from the reference in M, B and K.

        In percent of the reference's matrix and in standard errors of the difference; `reason`
        says why a method cannot run.
        """
        import pandas as pd

        return pd.DataFrame([row for side in self.groups for row in self._rows(side)])

    def _rows(self, side: SideBySide) -> Iterator[dict[str, Any]]:
        apart = {d.method: d for d in side.disagreements}
        for result in side.results:
            row = {**side.keys, "method": result.method, "reason": result.reason}
            known = apart.get(result.method)
            for i, symbol in enumerate("MBK"):
                row[f"{symbol}_percent"] = np.nan if known is None else known.percent[i]
                row[f"{symbol}_standard_errors"] = (
                    np.nan if known is None else known.standard_errors[i]
                )
            yield row

    def __str__(self) -> str:
        return methods_table(self.groups, self.reference)

    def _lines(self) -> list[str]:
        said = [
            f"{group_name(side.keys)}: {sentence}"
            for side in self.groups
            for d in side.disagreements
            for sentence in d.sentences
        ]
        nothing = f"no method differs from {self.reference} by more than chance and a few percent"
        left = [f"... and {len(said) - 10} more"] if len(said) > 10 else []
        return [f"{len(self.groups)} groups", *(said[:10] or [nothing]), *left]

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _repr_html_(self) -> str:
        return "".join(f"<p>{escape(line)}</p>" for line in self._lines())


@dataclass(frozen=True, repr=False, eq=False)
class ReflexVerdicts(FrozenRecord, Sequence[ReflexVerdict]):
    """What the reflex guard says of every group of trials.

    Iteration gives `ReflexVerdict`; a number, or the value of a group's column, finds one.

    Attributes
    ----------
    verdicts : tuple of ReflexVerdict
    """

    verdicts: tuple[ReflexVerdict, ...]

    def __len__(self) -> int:
        return len(self.verdicts)

    @overload
    def __getitem__(self, which: int | str | tuple[Any, ...]) -> ReflexVerdict: ...
    @overload
    def __getitem__(self, which: slice) -> ReflexVerdicts: ...
    def __getitem__(
        self, which: int | slice | str | tuple[Any, ...]
    ) -> ReflexVerdict | ReflexVerdicts:
        """Look up verdicts by position, slice or name.

        Raises
        ------
        InputError
            No group has this name, or several have; the message lists the names.
        """
        if isinstance(which, slice):
            return ReflexVerdicts(self.verdicts[which])
        if isinstance(which, int | np.integer):
            return self.verdicts[which]
        return self.verdicts[position_of(which, [tuple(v.keys.values()) for v in self])]

    @property
    def names(self) -> tuple[str, ...]:
        """The groups in words: the condition alone, or all columns with their values."""
        return tuple(group_name(verdict.keys) for verdict in self)

    def to_frame(self) -> pd.DataFrame:
        """One row a group, with the columns of ``armimpedance reflex --out``."""
        import pandas as pd

        return pd.DataFrame(verdict_rows(self.verdicts))

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping a group, with the names of the table's columns."""
        return verdict_rows(self.verdicts)

    def write(self, path: PathLike) -> None:
        """Write the table; the ending decides: .csv, .json or .parquet.

        Raises
        ------
        InputError
            Another ending, or the file cannot be written.
        """
        write_table(verdict_rows(self.verdicts), path)

    def plot(self, axes: Any = None) -> Any:
        """Draw K over the window's end and the evidence over the delay, one row a group.

        Parameters
        ----------
        axes : (n, 2) array of Axes, optional

        Returns
        -------
        axes : (n, 2) array of Axes
        """
        return plot_reflex(self.verdicts, axes)

    def _table(self) -> list[list[str]]:
        rows = [[name, headline(v)] for name, v in zip(self.names, self, strict=True)]
        left = [["...", f"{len(rows) - 10} more"]] if len(rows) > 10 else []
        return [["group", "verdict"], *rows[:10], *left]

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {said}" for name, said in self._table()[1:])

    def _repr_html_(self) -> str:
        return html_table(self._table())
