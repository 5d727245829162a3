"""A mapping that is proposed for the files at a path."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from armimpedance.core.errors import InputError
from armimpedance.recordings.mapped.columns_toml import MAPPING_FILE
from armimpedance.recordings.mapped.door import files_of, read_files
from armimpedance.recordings.mapped.proposal import proposal_for
from armimpedance.recordings.mapped.template import mapping_text


@dataclass(frozen=True)
class ProposedMapping:
    """A mapping to be read and edited.

    Attributes
    ----------
    text : str
        TOML with a reason beside each line; a "?" for each word that is still to be decided.
    place : Path
        Where it would be found without being named: `columns.toml` with the file.
    found : tuple of str
        What the columns were taken for, one line each.
    cannot_tell : tuple of str
        What only the user can say.
    """

    text: str
    place: Path
    found: tuple[str, ...]
    cannot_tell: tuple[str, ...]


def propose_mapping(path: str | os.PathLike[str], files: str | None = None) -> ProposedMapping:
    """Propose which column of a file is what, from names, units and data.

    Whose force on the other the columns hold is never decided, only what the data say of it.

    Parameters
    ----------
    path : path
        A table of any layout, or a folder of them.
    files : str, optional
        Which files of a folder, such as ``"trial_*.csv"``.

    Returns
    -------
    ProposedMapping

    Raises
    ------
    InputError
        The file cannot be read, or no mapping can explain such a file.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from armimpedance.recordings import propose_mapping
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "log.csv")
    ...     rows = "".join(f"{i},0.0{i},0.4,1,{i}\\n" for i in range(9))
    ...     _ = file.write_text("Time (ms),x (m),y (m),Fx (N),Fy (N)\\n" + rows)
    ...     print(*propose_mapping(file).found, sep="\\n")
    time: Time (ms) in ms (stated by the file)
    position: x (m), y (m) in m (stated by the file)
    force: Fx (N), Fy (N) in N (stated by the file)
    trials: by run
    """
    place = Path(path)
    if not place.exists():
        raise InputError("no such file or folder", file=path, expected="a table")
    chosen = files_of(place, files)
    read = read_files(chosen[:1], lambda _name: True)
    proposal = proposal_for(read[0].raw, len(chosen))
    if place.is_dir() and chosen[0] != place:
        proposal.files = files or f"*{chosen[0].suffix}"
    whose = "whose force on the other it is" + (": " + " ".join(proposal.evidence)).rstrip(": ")
    return ProposedMapping(
        text=mapping_text(proposal, place.name),
        place=(place if place.is_dir() else place.parent) / MAPPING_FILE,
        found=proposal.lines(),
        cannot_tell=(*proposal.cannot_tell, whose),
    )
