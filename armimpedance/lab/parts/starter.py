"""An example folder that runs at once: data in a laboratory's own files, a script, a notebook."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.method_table import MethodTable
from armimpedance.lab.lab_forms import FORMS
from armimpedance.lab.parts.simulation import TRUTH_FILE, Truth

if TYPE_CHECKING:
    from armimpedance.core.motion import MarkerRecording
    from armimpedance.core.records import Recording
    from armimpedance.recordings import AnyRecording

#: What the folder holds beside the data.
README, SCRIPT, NOTEBOOK = "README.md", "analysis.py", "analysis.ipynb"


@dataclass(frozen=True)
class NotebookCell:
    """One step of an analysis: what it does, in words, and the code."""

    text: str
    code: str


@dataclass(frozen=True)
class Starter:
    """An example folder.

    `line`: what the help says of it.
    `title`: of its README.
    `about`: what the data are.
    `data`: files and folders that `write` makes.
    `write`: writes the data and their truth into an empty folder.
    `commands` tuple of (str, str): what a command does, and the command.
    `cells`: the same in Python.
    `own`: what to change for one's own files.
    """

    line: str
    title: str
    about: str
    data: tuple[tuple[str, str], ...]
    write: Callable[[Path], None]
    commands: tuple[tuple[str, str], ...]
    cells: tuple[NotebookCell, ...]
    own: str

    @property
    def names(self) -> tuple[str, ...]:
        """All that the folder holds."""
        return (README, SCRIPT, NOTEBOOK, *(name for name, _ in self.data))


#: How every analysis goes on once the recording is read.
LOOK: Final = NotebookCell(
    "Look at it before anything is estimated: every check says what it would have seen.",
    "print(ai.inspect(recording))",
)
#: Pushes of the hand, from the recording to what is shown.
HAND_CELLS: Final = (
    LOOK,
    NotebookCell(
        "Inertia, viscosity and stiffness of the hand, one row a condition.",
        'hand = ai.estimate(recording)\nhand.to_csv("hand.csv")\nprint(hand)',
    ),
    NotebookCell(
        "The ellipses, and a page to show.",
        'axes = ai.plot_ellipses(hand)\nai.save(axes.figure, "ellipses")\n'
        'ai.write_report(recording, "report.html")',
    ),
)

#: Each starter is a file in the folder, with the record STARTER.
STARTERS: Final = MethodTable[Starter]("armimpedance.lab.starters", "STARTER", "lab", joint="-")


def write_starter(starter: Starter, folder: Path) -> None:
    """Write the folder of a starter, whole or not at all.

    `folder`: new, empty, or an earlier starter.
    """
    from armimpedance.core.outputs import staged_folder

    folder.parent.mkdir(parents=True, exist_ok=True)
    with staged_folder(folder, SCRIPT, starter.names) as staged:
        starter.write(staged)
        (staged / README).write_text(readme_text(starter), encoding="utf-8")
        (staged / SCRIPT).write_text(script_text(starter), encoding="utf-8")
        (staged / NOTEBOOK).write_text(notebook_text(starter), encoding="utf-8")


def readme_text(starter: Starter) -> str:
    """The README in Markdown."""
    width = max(len(command) for _, command in starter.commands)
    commands = [f"{command.ljust(width)}   # {what}" for what, command in starter.commands]
    files = [f"| `{name}` | {what} |" for name, what in starter.data]
    return "\n".join(
        [
            f"# {starter.title}",
            "",
            starter.about,
            "",
            "## Run it",
            "",
            "```",
            *commands,
            "```",
            "",
            f"The same in Python: `python {SCRIPT}`, or step by step in `{NOTEBOOK}`.",
            "",
            "## What is here",
            "",
            "| file | what |",
            "| --- | --- |",
            *files,
            f"| `{SCRIPT}`, `{NOTEBOOK}` | the analysis as a script and as a notebook |",
            "",
            "## With your own files",
            "",
            starter.own,
            "",
        ]
    )


def script_text(starter: Starter) -> str:
    """The analysis as a script."""
    parts = [f'"""{starter.title}."""', ""]
    for cell in starter.cells:
        parts += [*(f"# {line}" for line in cell.text.splitlines()), cell.code, ""]
    return "\n".join(parts)


def notebook_text(starter: Starter) -> str:
    """The analysis as a notebook (nbformat 4.5)."""
    cells: list[dict[str, Any]] = [_markdown("title", f"# {starter.title}\n\n{starter.about}")]
    for number, cell in enumerate(starter.cells, start=1):
        cells.append(_markdown(f"text-{number}", cell.text))
        code = {"id": f"code-{number}", "cell_type": "code", "metadata": {}, "source": cell.code}
        cells.append({**code, "execution_count": None, "outputs": []})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    notebook = {"nbformat": 4, "nbformat_minor": 5, "metadata": metadata, "cells": cells}
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


def _markdown(name: str, text: str) -> dict[str, Any]:
    return {"id": name, "cell_type": "markdown", "metadata": {}, "source": text}


# The simulated sessions of the example folders, in a laboratory's own files.

#: Every folder of a kind holds the same session.
SEED: Final = 2026
_LEVELS: Final = ("cocontraction_00", "cocontraction_10", "cocontraction_30")


def hand_session() -> tuple[Recording, Truth]:
    """Pushes of the hand at three levels of co-contraction, two sets each, and the truth."""
    from manipulandum_sim.hand import simulate

    return simulate("cocontraction", seed=SEED, sets=2, conditions=_LEVELS)


def joint_session() -> tuple[Recording, Truth]:
    """One joint under a random perturbation, two trials of ten seconds, and the truth."""
    from manipulandum_sim.elbow import simulate_elbow

    return simulate_elbow("posture", subject="1", seed=SEED, repetitions=2)


def filmed_session() -> tuple[MarkerRecording, Truth]:
    """A relaxed arm while the trunk is shaken, filmed, and the truth."""
    from manipulandum_sim.passive import simulate_passive

    return simulate_passive("p5", subject="1", seed=SEED)


def write_form(form: str, recording: AnyRecording, truth: Truth, folder: Path) -> None:
    """Write a session in a laboratory's form, and its truth."""
    FORMS[form].write(recording, folder)
    truth.write(folder / TRUTH_FILE)


def write_small_csv(recording: Recording, truth: Truth, folder: Path) -> None:
    """Write a CSV file for each trial in ms and mm with the device's force, and the truth."""
    from manipulandum_sim.lab_files import (
        column_name,
        mapping_text,
        numeric_facts,
        write_trial_files,
    )

    facts = numeric_facts(recording)
    write_trial_files(recording, folder / "trials", units="small", by="device", facts=facts)
    text = mapping_text(
        recording,
        lambda name: column_name(name, "small"),
        head=['files = "*.csv"'],
        trials=['pattern = "{condition}_{trial}.csv"'],
        condition=None,
        units="small",
        by="device",
    )
    (folder / "trials" / "columns.toml").write_text(text, encoding="utf-8")
    truth.write(folder / TRUTH_FILE)
