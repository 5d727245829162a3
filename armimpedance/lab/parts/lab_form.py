"""The forms in which a simulated session is written as a laboratory's own files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from armimpedance.core.errors import InputError
from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.recordings import AnyRecording

Holds = Literal["hand", "joint", "markers", "motion"]


@dataclass(frozen=True)
class LabForm:
    """Files as a laboratory has them.

    Attributes
    ----------
    line : str
        What the help says of it.
    holds : tuple of str
        Kinds of recordings that such files can hold.
    names : tuple of str
        What is written into the folder, the file or folder to read first.
    write : callable
        Writes a recording into an empty folder.
    """

    line: str
    holds: tuple[Holds, ...]
    names: tuple[str, ...]
    write: Callable[[Any, Path], None]


#: Each form is a file in the folder, with the record FORM.
FORMS: Final = MethodTable[LabForm]("armimpedance.lab.lab_forms", "FORM", "form", joint="-")


def form_for(name: str, recording: AnyRecording) -> LabForm:
    """The form of this name.

    Raises
    ------
    InputError
        There is none, or it cannot hold such a recording.
    """
    form = FORMS.named(name)
    kind = holds_of(recording)
    if kind not in form.holds:
        able = ", ".join(each for each in FORMS if kind in FORMS[each].holds)
        raise InputError(f"--as {name} of a recording of kind {kind!r}", expected=f"one of {able}")
    return form


def holds_of(recording: AnyRecording) -> Holds:
    """The kind of a recording, as the folder's own form names it."""
    from armimpedance.core.motion import MarkerRecording
    from armimpedance.core.records import Recording

    if isinstance(recording, Recording):
        return recording.kind
    return "markers" if isinstance(recording, MarkerRecording) else "motion"
