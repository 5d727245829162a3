"""Fitted numbers with names, units and uncertainty, for the results of all topics."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtrit

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.described import Column, Meaning, cells
from armimpedance.core.errors import EstimationError, InputError, check_level
from armimpedance.core.shown import PARAMETER_HEADS, html_table, parameter_row

if TYPE_CHECKING:
    import pandas as pd

# Two-sided intervals by the t distribution.


def t_factor(dof: float, level: float = 0.95) -> float:
    """Half-width of a two-sided interval in standard errors; dof inf = normal.

    Parameters
    ----------
    dof : float
        Degrees of freedom; inf = normal.
    level : float
        Confidence level, 0 to 1.

    Returns
    -------
    float
        Quantile of the t distribution: the half-width over the standard error.

    Raises
    ------
    InputError
        The level does not lie between 0 and 1.
    """
    check_level(level)
    upper = 0.5 + level / 2
    return float(ndtri(upper) if np.isinf(dof) else stdtrit(dof, upper))


def t_interval(values: FloatArray, sd: FloatArray, dof: float, level: float = 0.95) -> FloatArray:
    """Limits ``values -+ t sd`` (m, 2) of a two-sided interval; dof inf = normal.

    Parameters
    ----------
    values, sd : (m,)
    dof : float
        Degrees of freedom; inf = normal.
    level : float
        Confidence level, 0 to 1.

    Returns
    -------
    (m, 2) array
        Lower and upper limit of each value, in the values' unit.

    Raises
    ------
    InputError
        The level does not lie between 0 and 1.
    """
    half = t_factor(dof, level) * sd
    return np.stack([values - half, values + half], axis=-1)


Function = Callable[[FloatArray], ArrayLike]


@dataclass(frozen=True)
class NamedParameter:
    """One fitted number.

    Attributes
    ----------
    name, unit : str
    value, sd : float
        `sd`: standard error as the source computes it.
    sd_robust : float
        Robust standard error, from which intervals are computed.
    dof : float
        Degrees of freedom of the t distribution for the interval; inf = normal.
    joint : int or None
        Number of the joint, counted from 1; None if it does not apply.

    Examples
    --------
    >>> import armimpedance as ai
    >>> ai.NamedParameter("k", 2.95, 0.1, 0.1, "N m/rad").unit
    'N m/rad'
    """

    name: str
    value: float
    sd: float
    sd_robust: float
    unit: str
    dof: float = float("inf")
    joint: int | None = None

    @property
    def ci95(self) -> tuple[float, float]:
        """95 % limits from `sd_robust`."""
        low, high = t_interval(np.array([self.value]), np.array([self.sd_robust]), self.dof)[0]
        return float(low), float(high)

    @property
    def relative_sd_percent(self) -> float:
        """``100 sd / |value|``; inf for a value of zero."""
        return 100 * self.sd / abs(self.value) if self.value else float("inf")

    @property
    def well_identified(self) -> bool:
        """True if twice the larger of the two relative standard errors is below 10 %.

        The sources judge by `sd` alone; a parameter whose interval is wide is not well identified.
        """
        return 2 * 100 * max(self.sd, self.sd_robust) < 10 * abs(self.value)

    def __repr__(self) -> str:
        low, high = self.ci95
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.label} = {self.value:.4g}{unit} (95 %: {low:.4g} to {high:.4g})"

    def _repr_html_(self) -> str:
        return parameter_html([self])

    @property
    def label(self) -> str:
        """Name, and the joint if there is one."""
        return self.name if self.joint is None else f"{self.name} of joint {self.joint}"


@dataclass(frozen=True, repr=False)
class Parameters(FrozenRecord):
    """Fitted numbers with their joint covariance.

    Attributes
    ----------
    names, units : tuple of p str
    values : (p,)
    covariance : (p, p)
        Robust covariance, from which intervals are computed.
    covariance_kind : str
        Kind of the covariance: ``cr3``, ``cr1``, ``long-run``, ``fisher``, ...
    dof : float
        Degrees of freedom of the t distribution for intervals; inf = normal.
    plain_covariance : (p, p) or None
        Classical covariance, for independent residuals, as in the sources; None: the same.
    notes : tuple of str
        Remarks that matter for these numbers.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> session, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0)
    >>> ai.elbow(session).parameters.names
    ('I', 'B', 'K')
    """

    names: Annotated[tuple[str, ...], "p"]
    units: Annotated[tuple[str, ...], "p"]
    values: Annotated[FloatArray, "p"]
    covariance: Annotated[FloatArray, "p p"]
    covariance_kind: str = ""
    dof: float = float("inf")
    plain_covariance: Annotated[FloatArray, "p p"] | None = None
    notes: tuple[str, ...] = ()

    @property
    def sd(self) -> FloatArray:
        """Standard errors, (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def plain_sd(self) -> FloatArray:
        """Standard errors as a source computes them, (p,)."""
        return self.sd if self.plain_covariance is None else np.sqrt(np.diag(self.plain_covariance))

    def interval(self, level: float = 0.95) -> FloatArray:
        """Confidence limits, (p, 2)."""
        return t_interval(self.values, self.sd, self.dof, level)

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[NamedParameter]:
        return (self[i] for i in range(len(self)))

    def __getitem__(self, which: str | int) -> NamedParameter:
        """Return one parameter, by its name or its index from 0.

        Raises InputError: there is no parameter of this name.
        """
        if isinstance(which, str):
            if which not in self.names:
                known = ", ".join(self.names)
                raise InputError(f"no parameter {which!r}", expected=f"one of {known}")
            which = self.names.index(which)
        return NamedParameter(
            self.names[which],
            float(self.values[which]),
            float(self.plain_sd[which]),
            float(self.sd[which]),
            self.units[which],
            self.dof,
        )

    def transform(
        self,
        function: Function,
        names: Sequence[str],
        units: Sequence[str] | None = None,
        *,
        jacobian: Function | None = None,
    ) -> Parameters:
        """Functions of the parameters, with their covariance by the delta method.

        Parameters
        ----------
        function : callable
            ``(p,) -> (m,)``, of `values`; smooth near the estimate.
        names, units : sequences of str, length m
        jacobian : callable, optional
            ``(p,) -> (m, p)``; without it five-point differences are taken with steps of a
            thousandth of the parameter or of its standard error, whichever is larger.

        Returns
        -------
        Parameters
            The m values of `function`, with their covariance.

        Raises
        ------
        InputError
            Not as many names as values.
        EstimationError
            The function or its derivative is not finite.
        """
        at = self.values
        values = np.atleast_1d(np.asarray(function(at), dtype=np.float64))
        if values.shape != (len(names),) or len(units or names) != len(names):
            raise InputError(f"{len(names)} names for values of shape {values.shape}")
        if jacobian is not None:
            D = np.asarray(jacobian(at), dtype=np.float64).reshape(len(names), len(at))
        else:
            D = _differences(function, at, 1e-3 * np.maximum(np.abs(at), self.sd))
        if not (np.isfinite(values).all() and np.isfinite(D).all()):
            raise EstimationError(f"{', '.join(names)} or a derivative of it is not finite here")
        # C_g (m, m) = D (m, p) C (p, p) D^T
        covariance = D @ self.covariance @ D.T
        return Parameters(
            tuple(names),
            tuple(units or ("",) * len(names)),
            values,
            covariance,
            self.covariance_kind,
            self.dof,
        )

    def to_frame(self) -> pd.DataFrame:
        """Table with one row per parameter: value, standard error, 95 % limits, unit."""
        return parameter_frame(list(self))

    def to_dict(self) -> list[dict[str, Any]]:
        """List of one mapping per parameter, of plain numbers and texts."""
        return [parameter_dict(parameter) for parameter in self]

    def __repr__(self) -> str:
        return "\n".join(map(repr, self))

    def _repr_html_(self) -> str:
        return parameter_html(list(self))


@dataclass(frozen=True)
class Derived:
    """A number computed from the parameters: its meaning, and the function of them by name."""

    means: Meaning
    function: Callable[[Mapping[str, float]], float]


def with_derived(parameters: Parameters, derived: Mapping[str, Derived]) -> Parameters:
    """Append numbers computed from the parameters, with the covariance of all.

    Parameters
    ----------
    parameters : Parameters
        p of them.
    derived : mapping
        Name -> number computed from the parameters.

    Returns
    -------
    Parameters
        Robust and classical covariance are both propagated by the delta method.

    Raises
    ------
    EstimationError
        A function or its derivative is not finite.
    """
    if not derived:
        return parameters
    direct_names = parameters.names

    def function(x: FloatArray) -> ArrayLike:
        named = dict(zip(direct_names, x.tolist(), strict=True))
        return [*x, *(number.function(named) for number in derived.values())]

    units = (*parameters.units, *(number.means.unit for number in derived.values()))
    names, plain = (*direct_names, *derived), parameters.plain_covariance
    extended = replace(parameters.transform(function, names, units), notes=parameters.notes)
    if plain is None:
        return extended
    classical = replace(parameters, covariance=plain).transform(function, names, units)
    return replace(extended, plain_covariance=classical.covariance)


# Columns of a parameter in tables and files, each described once.

_JOINT: Final = Column[NamedParameter]("joint", "number of the joint, from 1", "1", optional=True)
_UNIT: Final = Column[NamedParameter]("unit", "unit of the value, its errors and limits")
_ROBUST: Final = "standard error to trust: residuals may be correlated"
_LOW: Final = Column[NamedParameter]("ci_low", "lower 95 % limit", value=lambda p: p.ci95[0])
_HIGH: Final = Column[NamedParameter]("ci_high", "upper 95 % limit", value=lambda p: p.ci95[1])
_NUMBERS: Final = (
    Column[NamedParameter]("value", "fitted value"),
    Column[NamedParameter]("sd", "standard error as the source prints it"),
    Column[NamedParameter]("sd_robust", _ROBUST),
)
_QUALITY: Final = (
    Column[NamedParameter](
        "rel_sd_percent", "sd as a part of the value", "%", lambda p: p.relative_sd_percent
    ),
    Column[NamedParameter](
        "well_identified", "whether twice the larger standard error is below 10 % of the value"
    ),
    _UNIT,
)
#: A parameter in FIT.json.
PARAMETER_OBJECT: Final = (
    Column[NamedParameter]("name", "name of the parameter"),
    _JOINT,
    *_NUMBERS,
    Column[NamedParameter]("ci95", "95 % limits, of sd_robust", value=lambda p: list(p.ci95)),
    *_QUALITY,
)
#: A parameter as a row of a table.
PARAMETER_ROW: Final = (
    Column[NamedParameter]("parameter", "name of the parameter", value=lambda p: p.name),
    _JOINT,
    *_NUMBERS,
    *_QUALITY,
    _LOW,
    _HIGH,
)
#: A parameter as a row of a data frame, indexed by the names.
_FRAME: Final = (
    _JOINT,
    _NUMBERS[0],
    Column[NamedParameter]("sd", _ROBUST, value=lambda p: p.sd_robust),
    _LOW,
    _HIGH,
    _UNIT,
)


def parameter_frame(parameters: Sequence[NamedParameter]) -> pd.DataFrame:
    """Table of parameters, one row each, with their 95 % limits."""
    import pandas as pd

    rows = [cells(_FRAME, parameter) for parameter in parameters]
    return pd.DataFrame(
        rows, index=pd.Index([parameter.name for parameter in parameters], name="parameter")
    )


def parameter_dict(parameter: NamedParameter) -> dict[str, Any]:
    """Return a parameter as it is written to FIT.json."""
    return cells(PARAMETER_OBJECT, parameter)


def parameter_rows(parameters: Sequence[NamedParameter]) -> tuple[tuple[str, ...], ...]:
    """Return the parameters as a table of texts, for pages and notebooks.

    Parameters
    ----------
    parameters : sequence of NamedParameter

    Returns
    -------
    tuple of tuples of str
        One row each, its cells under `core.shown.PARAMETER_HEADS`.
    """
    return tuple(
        parameter_row(
            parameter.label,
            parameter.value,
            parameter.ci95,
            parameter.unit,
            parameter.well_identified,
        )
        for parameter in parameters
    )


def parameter_html(parameters: Sequence[NamedParameter]) -> str:
    """Return the table of parameters for notebooks."""
    return html_table([PARAMETER_HEADS, *parameter_rows(parameters)])


def _differences(function: Function, at: FloatArray, step: FloatArray) -> FloatArray:
    """Jacobian (m, n) by central differences of fourth order."""
    columns = []
    for j, h in enumerate(np.where(step > 0, step, 1e-3)):
        e = np.zeros_like(at)
        e[j] = h
        f = [np.atleast_1d(np.asarray(function(at + m * e), dtype=float)) for m in (-2, -1, 1, 2)]
        columns.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h))
    return np.stack(columns, axis=1)
