"""What is said of several passive joints of one recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.arrays import FrozenRecord
from armimpedance.joint.relaxed.result import (
    PassiveFit,
    counted,
    joint_object,
    quality_object,
    summary_of,
)
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.numerics.regression import FitSummary, Validation
from armimpedance.numerics.signals import EmgLevel

if TYPE_CHECKING:
    import pandas as pd

#: Joints that a short text shows.
_MOST_SHOWN: Final = 8


@dataclass(frozen=True, repr=False, eq=False)
class PassiveFits(FrozenRecord, Sequence[PassiveFit]):
    """The fits of several joints of one recording: a sequence, and by a joint's name.

    Attributes
    ----------
    fits : tuple of PassiveFit
    samples : PassiveSamples
        Samples to which the models were fitted.
    notes : tuple of str
        Remarks that a reader must know of the recording.
    emg : EmgLevel or None
        How active the muscles were; None where that is not known.
    validations : tuple of Validation
        How well each joint's torque in another recording is predicted; none without one.
    validated_on : str
        Name of that recording.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.passive import simulate_passive
    >>> markers, _ = simulate_passive("release", trials=1, duration_s=4.0)
    >>> fits = ai.passive(markers, rest_angle=1.5)
    >>> len(fits)
    1
    """

    fits: tuple[PassiveFit, ...]
    samples: PassiveSamples
    notes: tuple[str, ...] = ()
    emg: EmgLevel | None = None
    validations: tuple[Validation, ...] = ()
    validated_on: str = ""

    def __len__(self) -> int:
        return len(self.fits)

    def __iter__(self) -> Iterator[PassiveFit]:
        return iter(self.fits)

    def __getitem__(self, which: Any) -> Any:
        """One fit by its number from 0 or its joint's name; a slice gives a tuple.

        Raises
        ------
        InputError
            No joint of this name was fitted.
        """
        return self.fits[self.samples.joint(which) if isinstance(which, str) else which]

    @property
    def summary(self) -> FitSummary:
        """One summary of all joints."""
        return summary_of(self.fits)

    def each(self, change: Callable[[PassiveFit], PassiveFit]) -> PassiveFits:
        """The same with every joint's fit changed."""
        return replace(self, fits=tuple(change(fit) for fit in self.fits))

    def predicting(self, samples: PassiveSamples, name: str) -> PassiveFits:
        """The same with how well they predict another recording of these joints.

        Raises
        ------
        InputError
            The samples do not hold one of the joints.
        """
        validations = tuple(fit.validate(samples) for fit in self.fits)
        return replace(self, validations=validations, validated_on=name)

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: joint, value, standard error, 95 % limits, unit."""
        return self.summary.to_frame()

    def to_dict(self) -> dict[str, Any]:
        """What FIT.json holds."""
        content = self.summary.to_dict()
        content["joints"] = [joint_object(fit) for fit in self.fits]
        content["emg"] = None if self.emg is None else self.emg.to_dict()
        if self.validations:
            judged = zip(self.fits, self.validations, strict=True)
            joints = [{"joint": fit.joint, **quality_object(v)} for fit, v in judged]
            content["validated_on"] = {"recording": self.validated_on, "joints": joints}
        return content

    def __repr__(self) -> str:
        lines = []
        for fit in self.fits[:_MOST_SHOWN]:
            shown = ", ".join(f"{p.name} {p.value:.4g} {p.unit}" for p in fit.parameters)
            lines.append(f"{fit.joint}: {shown}; R^2 {fit.direct.r2:.4f}")
        left, said = len(self) - len(lines), sum(len(fit.warnings) for fit in self.fits)
        more = [f"... and {left} more"] if left else []
        more += [counted(said, "warning")] if said else []
        head = f"{self.fits[0].method}, {counted(len(self), 'passive joint')}"
        return "\n".join([head, *lines, *more])

    def _repr_html_(self) -> str:
        return self.summary._repr_html_()
