"""The skeleton of a moving body: segments, hinges, and where markers sit. No algorithms.

World frame: x forward, y to the left, z up, m. At zero coordinates the body stands upright with
the arms hanging, and all segments' frames are parallel to the world's. A hinge turns about an axis
that is fixed in the frame the hinges before it have reached; a hinge's sign is in its axis, so that
flexion is positive where its name says flexion.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import RecordError

#: m/s^2, along -z (standard gravity).
GRAVITY_M_S2: Final = 9.80665

#: A floating root's coordinates: translations, then turns about z, y, x, each after the previous.
ROOT_TRANSLATIONS: Final = ("x", "y", "z")
ROOT_TURNS: Final = ("rz", "ry", "rx")


@dataclass(frozen=True)
class Hinge(FrozenRecord):
    """One angle of a joint, rad, about a unit axis (3,)."""

    name: str
    axis: Annotated[FloatArray, "3"]

    def __post_init__(self) -> None:
        super().__post_init__()
        squared = float(self.axis @ self.axis)
        if abs(squared - 1) > 1e-9:
            raise RecordError(f"axis of {self.name} has length {np.sqrt(squared):g}", expected="1")


@dataclass(frozen=True)
class Segment(FrozenRecord):
    """A rigid body and the joint that holds it to its parent.

    `parent`: None for the root only.
    `origin_m` (3,): joint centre in the parent's frame; the segment's own frame starts there. 0 for
    the root.
    `hinges`: hinges from the parent outwards; empty for the root.
    `mass_kg`: 0 if it is not known.
    `com_m` (3,): in the segment's frame.
    `inertia_kgm2` (3, 3): about the centre of mass, axes of the segment's frame.
    """

    name: str
    parent: str | None
    origin_m: Annotated[FloatArray, "3"]
    hinges: tuple[Hinge, ...] = ()
    mass_kg: float = 0.0
    com_m: Annotated[FloatArray, "3"] = field(default_factory=lambda: np.zeros(3))
    inertia_kgm2: Annotated[FloatArray, "3 3"] = field(default_factory=lambda: np.zeros((3, 3)))

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (np.isfinite(self.mass_kg) and self.mass_kg >= 0):
            raise RecordError(f"mass of {self.name} is {self.mass_kg} kg", expected="0 or more")
        if not np.allclose(self.inertia_kgm2, self.inertia_kgm2.T, atol=1e-12):
            raise RecordError(f"inertia of {self.name} is not symmetric")
        least, _, largest = np.linalg.eigvalsh(self.inertia_kgm2)
        if least < -1e-12 * abs(largest):
            problem = f"inertia of {self.name} is {least:.3g} kg m^2 about one axis"
            raise RecordError(problem, expected="0 or more about each")


@dataclass(frozen=True)
class MarkerSite(FrozenRecord):
    """Site of a marker: a point (3,) in a segment's frame, m."""

    name: str
    segment: str
    position_m: Annotated[FloatArray, "3"]


@dataclass(frozen=True)
class Skeleton(FrozenRecord):
    """A tree of segments, parents first, and the markers on it.

    Attributes
    ----------
    segments : tuple of Segment
    markers : tuple of MarkerSite
    floating : bool
        True: the root moves freely (six coordinates before all others); False: it is the world.

    Examples
    --------
    >>> from armimpedance.limb.arm import elbow_skeleton
    >>> skeleton = elbow_skeleton(70.0, 1.75)
    >>> "right_elbow_flexion" in skeleton.coordinates
    True
    """

    segments: tuple[Segment, ...]
    markers: tuple[MarkerSite, ...] = ()
    floating: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_tree(self.segments)
        known = {segment.name for segment in self.segments}
        for site in self.markers:
            if site.segment not in known:
                raise RecordError(f"marker {site.name}: no segment {site.segment!r}")
        for what, names in (("marker", self.marker_names), ("coordinate", self.coordinates)):
            if len(set(names)) != len(names):
                raise RecordError(f"two {what}s of one name in a skeleton")

    @property
    def root_coordinates(self) -> tuple[str, ...]:
        """Names of the six coordinates of a floating root; empty for a fixed one."""
        root = self.segments[0].name
        return tuple(f"{root}_{c}" for c in ROOT_TRANSLATIONS + ROOT_TURNS) if self.floating else ()

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the n coordinates: the root's six, then every hinge in the segments' order."""
        hinges = tuple(h.name for s in self.segments for h in s.hinges)
        return self.root_coordinates + hinges

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns on disk: ``_m`` for the root's translations, ``_rad`` for angles."""
        places = len(ROOT_TRANSLATIONS) if self.floating else 0
        names = self.coordinates
        return tuple(f"{c}_m" if i < places else f"{c}_rad" for i, c in enumerate(names))

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Names of the markers."""
        return tuple(m.name for m in self.markers)

    @property
    def mass_kg(self) -> float:
        """Mass of all segments together, kg."""
        return float(sum(s.mass_kg for s in self.segments))

    def index(self, segment: str) -> int:
        """Index of the segment of this name.

        Raises
        ------
        RecordError
            There is no such segment.
        """
        names = [s.name for s in self.segments]
        if segment not in names:
            raise RecordError(f"no segment {segment!r}", expected=f"one of {', '.join(names)}")
        return names.index(segment)

    def coordinate(self, name: str) -> int:
        """Index of the coordinate of this name.

        Raises
        ------
        RecordError
            There is no such coordinate.
        """
        if name not in self.coordinates:
            known = ", ".join(self.coordinates)
            raise RecordError(f"no coordinate {name!r}", expected=f"one of {known}")
        return self.coordinates.index(name)


def _require_tree(segments: tuple[Segment, ...]) -> None:
    """Require a root first, and for every other segment hinges and a parent before it."""
    root = segments[0] if segments else None
    if root is None or root.parent is not None or root.hinges or root.origin_m.any():
        expected = "first a segment without parent and hinges, its origin 0"
        raise RecordError("a skeleton without a root", expected=expected)
    seen: set[str] = set()
    for i, segment in enumerate(segments):
        if segment.name in seen:
            raise RecordError(f"segment {segment.name} appears twice in a skeleton")
        if i > 0 and segment.parent not in seen:
            raise RecordError(f"{segment.name}: no segment {segment.parent!r} before it")
        if i > 0 and not segment.hinges:
            raise RecordError(f"{segment.name} has no hinge", expected="one or more")
        seen.add(segment.name)
