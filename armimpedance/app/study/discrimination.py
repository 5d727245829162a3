"""Two groups of people told apart by one parameter of their fits."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison import Discrimination, PeopleGroup, discriminate_groups
from armimpedance.joint.relaxed import PassiveFit, PassiveFits
from armimpedance.numerics.regression import NamedParameter
from armimpedance.show.files import read_parameter
from armimpedance.show.verbs.results import PathLike

Person = PathLike | PassiveFits | PassiveFit | NamedParameter


def discriminate(
    groups: Mapping[str, Sequence[Person] | Mapping[str, Person]],
    *,
    parameter: str = "k",
    joint: int | None = None,
) -> Discrimination:
    """Tell two groups of people apart by one parameter, such as their stiffness.

    Parameters
    ----------
    groups : mapping of two names to people
        Each person is the path of a FIT.json, what `passive` returned, the fit of one of its
        joints, or one fitted parameter. A mapping of people says what they are called; otherwise it
        is the file's name, or a number.
    parameter : str
        Which one; of a fitted parameter its own name counts.
    joint : int, optional
        Whose, from 1, where a fit has several joints.

    Returns
    -------
    Discrimination
        Difference of means, effect size, Mann-Whitney's test, area under the ROC curve, and how
        many people a threshold puts right that was made without them.

    Raises
    ------
    InputError
        Not two groups of three people or more, a person twice, no such parameter or several, or
        different units.

    Examples
    --------
    >>> from armimpedance.app.study import discriminate
    >>> from armimpedance.numerics.regression import NamedParameter
    >>> def people(*values):
    ...     return [NamedParameter("k", value, 0.1, 0.1, "N m/rad") for value in values]
    >>> told = discriminate({"controls": people(3.9, 4.2, 4.4), "patients": people(5.3, 5.6, 6.2)})
    >>> told.auc
    1.0
    >>> told.quantity
    'k (N m/rad)'
    """
    if len(groups) != 2:
        raise InputError(f"{len(groups)} groups", expected="two")
    first, second = (_group(name, people, parameter, joint) for name, people in groups.items())
    return discriminate_groups(first, second, parameter)


def _group(
    name: str,
    people: Sequence[Person] | Mapping[str, Person],
    parameter: str,
    joint: int | None,
) -> PeopleGroup:
    """A group and the values of its people."""
    if not isinstance(people, Mapping | Sequence) or isinstance(people, str):
        raise InputError(f"group {name}: {type(people).__name__}", expected="a list of people")
    named = list(people.items() if isinstance(people, Mapping) else map(_named, people, count(1)))
    files = [os.fspath(p) for _, p in named if isinstance(p, str | os.PathLike)]
    twice = [file for file in files if files.count(file) > 1]
    if twice:
        raise InputError(f"group {name}: {min(twice)} appears twice", expected="one file a person")
    values = [_value(person, parameter, joint) for _, person in named]
    units = sorted({value.unit for value in values})
    if len(units) > 1:
        raise InputError(f"group {name}: {' and '.join(units)}", expected="one unit")
    pairs = np.array([(value.value, value.sd_robust) for value in values]).reshape(-1, 2)
    return PeopleGroup(
        name, tuple(who for who, _ in named), pairs[:, 0], pairs[:, 1], "".join(units)
    )


def _named(person: Person, number: int) -> tuple[str, Person]:
    """Name a person without a name by the file, or by the number."""
    name = Path(person).stem if isinstance(person, str | os.PathLike) else str(number)
    return name, person


def _value(person: Person, parameter: str, joint: int | None) -> NamedParameter:
    if isinstance(person, NamedParameter):
        return person
    if isinstance(person, str | os.PathLike):
        return read_parameter(Path(person), parameter, joint)
    if isinstance(person, PassiveFit):
        return person.parameters[parameter]
    if not isinstance(person, PassiveFits):
        raise InputError(
            f"a person as {type(person).__name__}", expected="what passive gives, or its FIT.json"
        )
    if joint is None and len(person) > 1:
        numbers = ", ".join(str(fit.number) for fit in person)
        raise InputError(f"{parameter} of several joints", expected=f"a joint: {numbers}")
    fits = [fit for fit in person if joint in (None, fit.number)]
    if not fits:
        raise InputError(f"no joint {joint}", expected=f"1 to {len(person)}")
    return fits[0].parameters[parameter]
