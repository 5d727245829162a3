"""Results of a fit of one joint: I, B and K at an operating point, or over time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.described import Meaning
from armimpedance.core.errors import RecordError
from armimpedance.core.findings import Finding
from armimpedance.core.shown import html_table
from armimpedance.numerics.regression import FitSummary, NamedParameter, Parameters, t_interval
from armimpedance.show.files import (
    About,
    Content,
    FittedResult,
    WrittenResult,
    course_struct,
    table_content,
)

if TYPE_CHECKING:
    import pandas as pd

#: Names and units of the three parameters of (3), in this order everywhere.
LIMB: Final = {
    "I": Meaning("inertia", "kg m^2"),
    "B": Meaning("viscosity", "N m s/rad"),
    "K": Meaning("stiffness", "N m/rad"),
}
NAMES: Final = tuple(LIMB)
UNITS: Final = tuple(means.unit for means in LIMB.values())
#: Largest number of warnings in a short text.
_MOST_WARNINGS: Final = 5


@dataclass(frozen=True)
class ChannelSnr:
    """Signal to noise of the raw channels, dB of power over the whole band; None if not known."""

    torque_db: float | None
    angle_db: float | None


@dataclass(frozen=True)
class Whiteness:
    """Test of the residuals for whiteness; a misfit or a filter makes them correlated.

    `statistic`, `p`: statistic of Ljung and Box over `lags` lags, and the probability that white
    residuals give one as large.
    `largest_correlation`: the largest autocorrelation at any lag but zero.
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
class ElbowFit(FittedResult, FrozenRecord):
    """I, B and K of one joint.

    Attributes
    ----------
    method : str
    parameters : Parameters
        I, B, K with their robust covariance; `plain_covariance` takes residuals as independent.
    n : int
        Rows of the regression.
    cond_raw, cond_scaled : float
        Condition number of its columns as they are, and scaled to unit length.
    rank : int
    r2 : float
        Share of the angle's power in the band that the torque explains by I, B and K.
    snr : ChannelSnr
    whiteness : Whiteness
    joint : int
        Axis of the recording, counted from 1.
    preparation : tuple of str
        Filter, decimation and band: the choice and its reason, one sentence each.
    warnings : tuple of str
    details : mapping
        Further results of a method: its discrete model, the orders that were compared.
    parts : mapping str -> ElbowFit
        Fits of single conditions or trials, where these were made.
    checks : tuple of Finding
        Every assumption of the model that was tested on the record.
    allowing : Parameters or None
        I, B, K if there were a reflex or a skew that the record is too weak to exclude. If one is
        detected, they are `parameters`.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> session, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0)
    >>> fit = ai.elbow(session)
    >>> fit.inertia.unit, fit.viscosity.unit, fit.stiffness.unit
    ('kg m^2', 'N m s/rad', 'N m/rad')
    """

    MEANINGS = LIMB

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
    allowing: Parameters | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.parameters.names != NAMES:
            raise RecordError("the parameters of a joint", expected=", ".join(NAMES))

    def __getitem__(self, name: str) -> NamedParameter:
        """I, B or K, with the number of its joint.

        Raises InputError: there is no parameter of this name.
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
        """Fields that FIT.json has for every fit."""
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

    def to_dict(self) -> dict[str, Any]:
        """Fields of FIT.json: those of every fit, how the fit was made, and its parts."""
        return {
            **self.summary.to_dict(),
            "covariance": self.parameters.covariance,
            "ci95_allowing": None
            if self.allowing is None
            else dict(zip(NAMES, self.allowing.interval().tolist(), strict=True)),
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

    @property
    def _named(self) -> Iterator[NamedParameter]:
        return (self[name] for name in NAMES)


def short_text(head: str, lines: list[str], warnings: tuple[str, ...]) -> str:
    """Text of a few lines: the numbers, then the first warnings."""
    shown = [f"warning: {warning}" for warning in warnings[:_MOST_WARNINGS]]
    more = len(warnings) - len(shown)
    return "\n".join([head, *lines, *shown, *([f"... and {more} more warnings"] if more else [])])


def plain(value: Any) -> Any:
    """Return records as mappings, for JSON."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    return [plain(v) for v in value] if isinstance(value, (list, tuple)) else value


# Result of an analysis of one joint over time: I constant, B and K with their bands.

#: Columns of COURSE.csv; a variable of another name may take the place of ``time_s``.
COURSE: Final = {
    **LIMB,
    "G": Meaning("gain of the reflex pathway", "N m s/rad"),
    "time_s": Meaning("time from the trial's first sample", "s"),
    "angle": Meaning("angle over which B and K are given", "rad"),
    "torque": Meaning("torque over which B and K are given", "N m"),
    "emg_{}": Meaning("amplitude of {} over which B and K are given", "1"),
    "delay_s": Meaning("delay of the reflex", "s"),
    "cutoff_hz": Meaning("cut-off of the reflex pathway's low-pass", "Hz"),
    "order": Meaning("order of the reflex pathway's low-pass", "1"),
    "side": Meaning("velocities that the reflex answers"),
    "trial": Meaning("number of the trial"),
    "method": Meaning("method of the analysis"),
    "warnings": Meaning("what the analysis warns of"),
}


@dataclass(frozen=True, eq=False)
class ReflexCourse(FrozenRecord):
    """The reflex pathway: its gain over time, and its constants.

    The gain comes after the low-pass: torque ``G(t) LP[v(t - delay)]``, v the velocity or one
    side of it.

    `G`, `sd_G` (L,): N m s/rad.
    `cutoff_hz`, `sd_cutoff_hz`: of a low-pass whose poles are all alike.
    `side`: velocities that the reflex responds to.
    """

    G: Annotated[FloatArray, "l"]
    sd_G: Annotated[FloatArray, "l"]
    delay_s: float
    sd_delay_s: float
    cutoff_hz: float
    sd_cutoff_hz: float
    order: int
    side: str

    def constants(self) -> dict[str, Any]:
        """All fields except those over time."""
        return {
            **{"delay_s": self.delay_s, "sd_delay_s": self.sd_delay_s},
            **{"cutoff_hz": self.cutoff_hz, "sd_cutoff_hz": self.sd_cutoff_hz},
            **{"order": self.order, "side": self.side},
        }


@dataclass(frozen=True, repr=False, eq=False)
class VaryingImpedance(WrittenResult, FrozenRecord):
    """I constant, B and K over time, with bands.

    Samples of T trials, one trial after another; L points in all.

    Attributes
    ----------
    method : str
    trials : (T,) tuple of str
    offsets : (T + 1,) int
        Points of trial t are ``offsets[t]:offsets[t + 1]``.
    time_s : (L,)
        From each trial's first sample.
    B, K : (L,)
    sd_B, sd_K : (L,)
        Standard errors; the band is pointwise.
    parameters : Parameters
        The constant parameter I. Its degrees of freedom serve the bands too.
    snr : ChannelSnr
    joint : int
        Axis of the recording, counted from 1.
    preparation, warnings : tuple of str
    details : mapping
        Further results of a method: noise level chosen, knots, coefficients of a law.
    notes : tuple of str
        Processing of the EMG amplitudes, if there are any.
    checks : tuple of Finding
        Assumptions that were tested: the subject's own torque, the electrodes.
    reflex : ReflexCourse or None
        The reflex pathway, if one was searched for and detected.
    over : str
        Name of what `time_s` holds: "time_s", or the variable of which B and K are functions.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> session, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0)
    >>> course = ai.elbow_over_time(session, method="windows")
    >>> {"ci_low_K", "K", "ci_high_K"} <= set(course.to_frame().columns)
    True
    """

    DESCRIBED = COURSE

    method: str
    trials: Annotated[tuple[str, ...], "t"]
    offsets: Annotated[IntArray, "t+1"]
    time_s: Annotated[FloatArray, "l"]
    B: Annotated[FloatArray, "l"]
    K: Annotated[FloatArray, "l"]
    sd_B: Annotated[FloatArray, "l"]
    sd_K: Annotated[FloatArray, "l"]
    parameters: Parameters
    snr: ChannelSnr
    joint: int = 1
    preparation: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    checks: tuple[Finding, ...] = ()
    reflex: ReflexCourse | None = None
    over: str = "time_s"

    def __post_init__(self) -> None:
        super().__post_init__()
        if int(self.offsets[-1]) != len(self.time_s):
            raise RecordError(f"{len(self.time_s)} points", expected=f"{self.offsets[-1]}")

    @property
    def inertia(self) -> NamedParameter:
        """I, kg m^2."""
        return replace(self.parameters["I"], joint=self.joint)

    def points_of(self, row: int) -> slice:
        """The points of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))

    def band(self, name: str, level: float = 0.95) -> FloatArray:
        """Pointwise limits of B or K, or of the reflex's gain G, (L, 2)."""
        source: Any = self.reflex if name == "G" else self
        return t_interval(getattr(source, name), getattr(source, f"sd_{name}"), self.dof, level)

    @property
    def dof(self) -> float:
        """Degrees of freedom of the t distribution for the bands; inf = normal."""
        return self.parameters.dof

    def to_frame(self) -> pd.DataFrame:
        """One row per point: time, B and K with 95 % limits and standard errors, I, trial."""
        import pandas as pd

        low, high = self.inertia.ci95
        bands = {
            f"ci_{side}_{name}": self.band(name)[:, at]
            for name in "BK"
            for at, side in enumerate(("low", "high"))
        }
        columns = {
            **{self.over: self.time_s, "B": self.B, "K": self.K, **bands},
            **{"sd_B": self.sd_B, "sd_K": self.sd_K},
            **self._reflex_columns(),
            **{"I": self.inertia.value, "ci_low_I": low, "ci_high_I": high},
            "trial": np.repeat(np.array(self.trials, dtype=object), np.diff(self.offsets)),
            **{"method": self.method, "warnings": "; ".join(self.warnings)},
        }
        return pd.DataFrame(columns)

    def _reflex_columns(self) -> dict[str, Any]:
        if self.reflex is None:
            return {}
        low, high = self.band("G").T
        limits = {"ci_low_G": low, "ci_high_G": high, "sd_G": self.reflex.sd_G}
        return {"G": self.reflex.G, **limits, **self.reflex.constants()}

    @property
    def content(self) -> Content:
        """Content of COURSE.csv: one row per point, numbers to ten digits."""
        table = self.to_frame()
        rows = [{str(name): c for name, c in row.items()} for row in table.to_dict("records")]
        columns = list(table.columns)
        return table_content(
            rows,
            columns,
            keys=("trial", self.over, "method"),
            described=COURSE,
            structs=lambda: [course_struct(columns, rows, COURSE)],
            about=About(checks=tuple(self.checks)),
            digits=10,
        )

    def to_dict(self) -> dict[str, Any]:
        """Method, I, and the course as lists of numbers."""
        course = self.to_frame().drop(columns=["method", "warnings"])
        return {
            "method": self.method,
            "parameters": self.parameters.to_dict(),
            "warnings": list(self.warnings),
            "checks": [check.to_dict() for check in self.checks],
            "course": course.to_dict("list"),
        }

    def __repr__(self) -> str:
        ranges = [f"{n} from {low:.4g} to {high:.4g} {u}" for n, low, high, u in self._ranges]
        head = f"{self.method}: {len(self.time_s)} points of {len(self.trials)} trials"
        return short_text(head, [repr(self.inertia), *ranges], self.warnings)

    def _repr_html_(self) -> str:
        shown = [(name, f"{low:.4g} to {high:.4g}", unit) for name, low, high, unit in self._ranges]
        course = html_table([("over time", "range", "unit"), *shown])
        warned = "".join(f"<li>{escape(warning)}</li>" for warning in self.warnings)
        head = f"<p>{escape(self.method)}</p>{self.parameters._repr_html_()}"
        return f"{head}{course}<ul>{warned}</ul>"

    @property
    def _ranges(self) -> list[tuple[str, float, float, str]]:
        """Name, lowest and highest value and unit of B and K."""
        courses = zip(NAMES[1:], (self.B, self.K), UNITS[1:], strict=True)
        return [(name, float(v.min()), float(v.max()), unit) for name, v, unit in courses]
