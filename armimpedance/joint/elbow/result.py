"""What a fit of one joint says: I, B and K at an operating point."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.errors import RecordError
from armimpedance.core.findings import Finding
from armimpedance.numerics.regression import FitSummary, NamedParameter, Parameters

if TYPE_CHECKING:
    import pandas as pd

#: Names and units of the three parameters of (3), in this order everywhere.
NAMES: Final = ("I", "B", "K")
UNITS: Final = ("kg m^2", "N m s/rad", "N m/rad")
#: Warnings that a short text shows.
_MOST_WARNINGS: Final = 5


@dataclass(frozen=True)
class ChannelSnr:
    """Signal to noise of the raw channels, dB of power over the whole band; None = cannot be told.

    Attributes
    ----------
    torque_db, angle_db : float or None
    """

    torque_db: float | None
    angle_db: float | None


@dataclass(frozen=True)
class Whiteness:
    """Are the residuals white? What a model left behind shows here, and what a filter put in.

    Attributes
    ----------
    statistic, p : float
        Statistic of Ljung and Box over `lags` lags, and the probability of one as large from white
        residuals.
    lags : int
    largest_correlation : float
        The largest autocorrelation at any lag but zero.
    """

    statistic: float
    p: float
    lags: int
    largest_correlation: float

    @property
    def probability(self) -> str:
        """The probability as a text shows it: ``p 0.03``, ``p < 1e-6``."""
        return "p < 1e-6" if self.p < 1e-6 else f"p {self.p:.2g}"


@dataclass(frozen=True, repr=False, eq=False)
class ElbowFit(FrozenRecord):
    """I, B and K of one joint.

    Attributes
    ----------
    method : str
    parameters : Parameters
        I, B, K with their robust covariance; `plain_covariance` takes residuals as independent.
    n : int
        Rows of the regression.
    cond_raw, cond_scaled : float
        Condition of its columns as they are, and scaled to unit length.
    rank : int
    r2 : float
        Part of the angle's power in the band that the torque explains by I, B and K.
    snr : ChannelSnr
    whiteness : Whiteness
    joint : int
        Axis of the recording, counted from 1.
    preparation : tuple of str
        Filter, decimation and band: what was chosen, and why, one sentence each.
    warnings : tuple of str
    details : mapping
        What a method adds: its discrete model, the orders that were compared.
    parts : mapping str -> ElbowFit
        The same of single conditions or trials, where they were fitted too.
    checks : tuple of Finding
        Every assumption of the model that was held against the record.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> session, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0)
    >>> fit = ai.elbow(session)
    >>> fit.inertia.unit, fit.viscosity.unit, fit.stiffness.unit
    ('kg m^2', 'N m s/rad', 'N m/rad')
    """

    method: str
    parameters: Parameters
    n: int
    cond_raw: float
    cond_scaled: float
    rank: int
    r2: float
    snr: ChannelSnr
    whiteness: Whiteness
    joint: int = 1
    preparation: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    parts: Mapping[str, ElbowFit] = field(default_factory=dict)
    checks: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.parameters.names != NAMES:
            raise RecordError("the parameters of a joint", expected=", ".join(NAMES))

    def __getitem__(self, name: str) -> NamedParameter:
        """I, B or K with the joint that it is of.

        Raises
        ------
        InputError
            There is no parameter of this name.
        """
        return replace(self.parameters[name], joint=self.joint)

    @property
    def inertia(self) -> NamedParameter:
        """I, kg m^2."""
        return self["I"]

    @property
    def viscosity(self) -> NamedParameter:
        """B, N m s/rad."""
        return self["B"]

    @property
    def stiffness(self) -> NamedParameter:
        """K, N m/rad."""
        return self["K"]

    @property
    def summary(self) -> FitSummary:
        """What FIT.json holds of every fit."""
        return FitSummary(
            method=self.method,
            n=self.n,
            cond_raw=self.cond_raw,
            cond_scaled=self.cond_scaled,
            rank=self.rank,
            r2=self.r2,
            vaf=self.r2,
            parameters=tuple(self[name] for name in NAMES),
            warnings=self.warnings,
            checks=self.checks,
        )

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: joint, value, standard error, 95 % limits, unit."""
        return self.summary.to_frame()

    def to_dict(self) -> dict[str, Any]:
        """What FIT.json holds: the contract's fields, how the fit was made, and its parts."""
        return {
            **self.summary.to_dict(),
            "covariance": self.parameters.covariance,
            "snr_db": {"torque": self.snr.torque_db, "angle": self.snr.angle_db},
            "residual_whiteness": plain(self.whiteness),
            "preparation": list(self.preparation),
            "details": {name: plain(value) for name, value in self.details.items()},
            "parts": [
                {"part": label, **part.summary.to_dict()} for label, part in self.parts.items()
            ],
        }

    def __repr__(self) -> str:
        return short_text(
            f"{self.method}, R^2 {self.r2:.3f}", list(map(repr, self._named)), self.warnings
        )

    def _repr_html_(self) -> str:
        return self.summary._repr_html_()

    @property
    def _named(self) -> Iterator[NamedParameter]:
        return (self[name] for name in NAMES)


def short_text(head: str, lines: list[str], warnings: tuple[str, ...]) -> str:
    """A text of a few lines: the numbers, then the first warnings."""
    told = [f"warning: {warning}" for warning in warnings[:_MOST_WARNINGS]]
    left = len(warnings) - len(told)
    return "\n".join([head, *lines, *told, *([f"... and {left} more warnings"] if left else [])])


def plain(value: Any) -> Any:
    """Records as mappings, for JSON."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    return [plain(v) for v in value] if isinstance(value, (list, tuple)) else value
