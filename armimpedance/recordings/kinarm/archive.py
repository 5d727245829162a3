"""Kinarm archives (`.kinarm`), the newer exports of Dexterit-E: a folder a trial, a file a channel.

`raw/common/` holds what all trials share, `raw/BB_TT_RR/` a trial: `header.bin`, `parameters.bin`,
`examevents.bin`, and the samples. What comes out is what a C3D file of the same trial gives.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d_parameters import Groups
from armimpedance.recordings.kinarm.archive_bytes import (
    Header,
    read_events,
    read_header,
    read_label,
    read_parameters,
    read_positions,
    read_samples,
)
from armimpedance.recordings.kinarm.exam_file import ExamFile, Samples, Store
from armimpedance.recordings.kinarm.packing import DEEPEST, Files

_SHARED: Final = re.compile(r"((?:.*/)?)common/(?:parameters|header)\.bin")
_TRIAL: Final = re.compile(r"(\d+)_(\d+)_(\d+)")

#: Labels stand at the beginning of a member.
_LABEL_BYTES: Final = 2048

#: Larger than what any exam says of itself; its samples are in other members.
_LARGEST_BIN: Final = 2 * 1024**2


def archive_roots(files: Files) -> set[str]:
    """The folders that hold a `common/`, with their slashes, those of an analysis aside."""
    found = {match[1] for name in files if (match := _SHARED.fullmatch(name))}
    return {
        root
        for root in found
        if root.count("/") <= DEEPEST and "analysis" not in root.lower().split("/")
    }


@dataclass
class Archive:
    """The folders of an archive's trials.

    Attributes
    ----------
    path : object
        For messages.
    files : mapping
        See `packing`.
    root : str
        The folder of `common/` and of the trials, with its slash.
    wanted : callable
        Which channels are read, by their labels.
    store : Store
        Where the samples are kept.
    """

    path: object
    files: Files
    root: str
    wanted: Callable[[str], bool]
    store: Store = field(default_factory=Store)
    _labels: dict[str, str] = field(default_factory=dict)

    def trials(self) -> Iterator[tuple[str, tuple[int, int, int]]]:
        """The folders of the trials, sorted, each with block, protocol and repetition."""
        names = {n[len(self.root) :].split("/")[0] for n in self.files if n.startswith(self.root)}
        for name in sorted(names):
            match = _TRIAL.fullmatch(name)
            if match:
                block, protocol, repetition = (int(part) for part in match.groups())
                yield name, (block, protocol, repetition)

    def common(self) -> ExamFile:
        """What all trials share.

        Raises
        ------
        InputError
            It is missing or damaged.
        """
        if f"{self.root}common/header.bin" in self.files:
            self._header("common")
        return ExamFile(
            f"{self.path}:{self.root}common", self._parameters("common"), 0.0, 0, {}, {}
        )

    def trial(self, folder: str) -> ExamFile:
        """One trial, with those of its channels that are wanted.

        Raises
        ------
        InputError
            One of the members that are needed is missing or damaged.
        """
        header = self._header(folder)
        parameters = self._parameters(folder)
        if f"{self.root}{folder}/examevents.bin" in self.files:
            events = read_events(*self._member(folder, "examevents.bin"))
            # The events stand here; a group of that name in the parameters is an older one.
            parameters = {**parameters, "EVENTS": events}
        channels, others = self._channels(folder, header)
        return ExamFile(
            name=f"{self.path}:{self.root}{folder}",
            parameters=parameters,
            rate_hz=header.rate_hz,
            frames=header.frames,
            hands=self._hands(folder, header),
            channels=channels,
            others=others,
            acknowledgements=header.acknowledgements,
        )

    def _member(self, folder: str, name: str, size: int | None = None) -> tuple[bytes, str]:
        """The bytes of a member, and its place for messages."""
        place = f"{self.root}{folder}/{name}"
        told = f"{self.path}:{place}"
        if place not in self.files:
            raise InputError("no such member", file=told, expected="a whole archive")
        is_bin = name.endswith(".bin")
        data = self.files[place](_LARGEST_BIN + 1 if is_bin else size)
        if is_bin and len(data) > _LARGEST_BIN:
            problem = f"is larger than {_LARGEST_BIN / 1024**2:g} MiB"
            raise InputError(problem, file=told, expected="a header, parameters or events")
        return data, told

    def _header(self, folder: str) -> Header:
        return read_header(*self._member(folder, "header.bin"))

    def _parameters(self, folder: str) -> Groups:
        return read_parameters(*self._member(folder, "parameters.bin"))

    def _label(self, folder: str, channel: str) -> str:
        """The label of a channel, which stands in its member; looked up once in an exam."""
        if channel not in self._labels:
            try:
                label = read_label(*self._member(folder, f"{channel}.kinematics", _LABEL_BYTES))
            except InputError:
                # Whether it is damaged is seen where it is read, if it is.
                return channel
            self._labels[channel] = label or channel
        return self._labels[channel]

    def _channels(
        self, folder: str, header: Header
    ) -> tuple[Mapping[str, Samples], tuple[str, ...]]:
        """The channels that are wanted, and the labels of the others."""
        channels: dict[str, Samples] = {}
        others = []
        for name in header.channels if header.frames else ():
            label = self._label(folder, name)
            if not self.wanted(label):
                others.append(label)
            elif label not in channels:
                own, samples = read_samples(*self._member(folder, f"{name}.kinematics"))
                if self._all_there(folder, own or name, len(samples), header):
                    channels[own or name] = self.store.keep(own or name, samples)
        return channels, tuple(others)

    def _hands(self, folder: str, header: Header) -> Mapping[str, Samples]:
        hands: dict[str, Samples] = {}
        for name in header.positions if header.frames else ():
            side = next((s for s in ("Right", "Left") if name.startswith(s)), None)
            if side is not None and f"{side}_Hand" not in hands:
                places = read_positions(*self._member(folder, f"{name}.position"))
                if self._all_there(folder, name, len(places), header):
                    hands[f"{side}_Hand"] = self.store.keep(name, places)
        return hands

    def _all_there(self, folder: str, label: str, count: int, header: Header) -> bool:
        """Whether a channel was recorded: all of it, or (False) nothing.

        Raises
        ------
        InputError
            A part of it is missing.
        """
        if count not in (0, header.frames):
            raise InputError(
                f"{count} samples, where the header says {header.frames}",
                file=f"{self.path}:{self.root}{folder}",
                column=label,
                expected="as many as the trial has frames",
            )
        return count > 0
