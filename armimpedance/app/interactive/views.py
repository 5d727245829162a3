"""Views of each step of the page: questions, checks, trials, results, files to save."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

import marimo as mo

from armimpedance.app.interactive.choice import ChosenAnalysis, Questions, written
from armimpedance.app.report.write import write_report
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.findings import MARKS
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.comparison.show import compare, plot_comparison
from armimpedance.hand.show import summary_table
from armimpedance.hand.still.show import estimate, plot_estimates, plot_quality
from armimpedance.recordings import AnyRecording
from armimpedance.show.pages import gravest_first
from armimpedance.show.plots import save

if TYPE_CHECKING:
    from armimpedance.hand.comparison.show import Comparison
    from armimpedance.hand.show import Estimates
    from armimpedance.show.verbs.inspected import Inspection

#: Trials of a page of the table.
_ROWS: Final = 8
#: A printed figure on the screen.
_PX_PER_INCH: Final = 125
#: A proposed mapping's line of whose force it is, until somebody decides.
_STATES_BY: Final = '# by = "limb"'
#: How a verdict is shown.
_KINDS: Final = {"ok": "success", "warning": "warn", "unusable": "danger"}

# One line for a user in place of a traceback.


def attempt(work: Callable[[], Any]) -> tuple[Any, Any]:
    """Return the work's result and None, or None and a view of its error."""
    try:
        return work(), None
    except ArmImpedanceError as error:
        return None, mo.callout(_paragraph(str(error)), kind="danger")


@contextmanager
def progress_of(title: str) -> Iterator[Progress]:
    """A bar that long work moves."""
    with mo.status.progress_bar(total=100, title=title, remove_on_exit=True) as bar:
        shown = 0

        def progress(done: int, of: int) -> None:
            nonlocal shown
            now = min(100, round(100 * done / max(of, 1)))
            if now > shown:
                bar.update(increment=now - shown)
                shown = now

        yield progress


# Before a file is read.


def form_of(questions: Questions) -> Any:
    """The questions as a form; but for the handle's mass its values are options of `read`."""
    fields: dict[str, Any] = {}
    if questions.exam is not None:
        onset, end = questions.exam.pair or (None, None)
        events = list(questions.exam.events)
        fields["onset_event"] = mo.ui.dropdown(events, value=onset, label="Disturbance begins at")
        fields["end_event"] = mo.ui.dropdown(events, value=end, label="Disturbance ends at")
        fields["force_by"] = _force_by("Whose force (nothing chosen: the robot's own motion tells)")
        if len(questions.exam.sides) > 1:
            sides = list(questions.exam.sides)
            fields["side"] = mo.ui.dropdown(sides, value=sides[0], label="Arm")
        fields["without_errors"] = mo.ui.checkbox(label="Without trials marked as errors")
    if questions.mapping is not None:
        fields["mapping"] = mo.ui.code_editor(
            questions.mapping, language="toml", label="What the columns mean", show_copy_button=True
        )
        if _STATES_BY in questions.mapping:
            fields["force_by"] = _force_by("Whose force the columns hold")
    fields["handle_mass_kg"] = mo.ui.number(
        0.0, 20.0, step=0.001, label="Mass between force sensor and hand (kg; 0: as the file says)"
    )
    fields["where"] = mo.ui.text(
        label="Only trials where", placeholder="block == 2 and is_error == 0", full_width=True
    )
    return mo.ui.dictionary(fields)


def _force_by(label: str) -> Any:
    whose = {"the limb's, on the device": "limb", "the device's, on the limb": "device"}
    return mo.ui.dropdown(whose, label=label)


def shown_form(path: Path, form: Any, questions: Questions) -> Any:
    """The form, and what only the user can say."""
    asked = [mo.callout(_paragraph("\n".join(questions.cannot_tell)), kind="warn")]
    head = [_paragraph(f"Chosen: {path}"), *(asked if questions.cannot_tell else [])]
    return mo.vstack([*head, *form.elements.values()])


def reading_of(answers: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The answers as options of `read`; a mapping is written into the folder."""
    given = {n: value for n, value in answers.items() if value and n != "handle_mass_kg"}
    if "mapping" not in given:
        return given
    path, text = folder / "columns.toml", given["mapping"]
    if whose := given.pop("force_by", None):
        text = text.replace(_STATES_BY.replace("limb", whose), f'by = "{whose}"')
    path.write_text(text, encoding="utf-8")
    return {**given, "mapping": str(path)}


# What was read.


def shown_inspection(inspection: Inspection) -> Any:
    """The verdict in its colour, then every check, the gravest first."""
    checks = gravest_first(inspection.checks)
    kind: Any = _KINDS[inspection.state]
    return mo.vstack(
        [
            mo.callout(_paragraph(inspection.verdict), kind=kind),
            mo.accordion(
                {
                    "What it holds": _paragraph(inspection.contents),
                    f"{len(checks)} checks": _table(
                        [MARKS[c.verdict].strip(), c.name, c.message] for c in checks
                    ),
                }
            ),
        ]
    )


def _paragraph(text: str) -> Any:
    """Lines of text that may come from a file: never read as Markdown or HTML."""
    return mo.Html(f'<div style="white-space: pre-wrap">{html.escape(text)}</div>')


def _table(rows: Iterable[Sequence[str]]) -> Any:
    cell = '<td style="padding: .1rem .8rem .1rem 0; vertical-align: top">'
    cells = ("".join(f"{cell}{html.escape(text)}</td>" for text in row) for row in rows)
    lines = "".join(f"<tr>{line}</tr>" for line in cells)
    return mo.Html(f'<div style="overflow-x: auto"><table>{lines}</table></div>')


def trial_table(recording: Recording) -> Any:
    """The trials, to be left out by a tick."""
    return mo.ui.table(
        recording.trials,
        selection="multi",
        page_size=_ROWS,
        show_column_summaries=False,
        show_data_types=False,
        show_download=False,
        label="Tick trials to leave them out",
    )


def shown_trials(recording: Recording, table: Any) -> dict[str, Any]:
    """The table of trials, and their courses where they can be drawn."""
    drawn, refused = attempt(lambda: plot_quality(recording))
    picture = refused if drawn is None else image(drawn, "All trials from their onsets")
    return {f"{recording.n_trials} trials": table, "Their courses": picture}


def image(figure: Any, caption: str) -> Any:
    """A picture as wide as the page at most. `said`: what is read aloud in its place."""
    content = written(lambda path: save(figure, path.with_suffix(""), ["png"]), "picture.png")
    size = {"width": f"{_PX_PER_INCH * figure.get_figwidth():.0f}px", "max-width": "100%"}
    return mo.image(content, alt=caption, style={**size, "background": "white"})


# What is estimated.


def estimated(recording: Recording, choice: ChosenAnalysis) -> Estimates:
    """M, B and K of each group."""
    with progress_of("Estimating") as progress:
        return estimate(recording, by=choice.by, progress=progress)


def compared(recording: Recording, choice: ChosenAnalysis) -> Comparison:
    """Differences between the groups."""
    with progress_of("Comparing") as progress:
        return compare(recording, by=choice.by, progress=progress)


def shown_estimates(hand: Estimates, figure: Any) -> Any:
    """The ellipses, every number with its interval, and what to beware of."""
    return mo.vstack(
        [
            image(figure, "Ellipses of stiffness"),
            mo.as_html(hand),
            mo.accordion(
                {
                    "Inertia, viscosity and stiffness, with intervals": mo.plain_text(
                        summary_table(hand)
                    ),
                    "Their ellipses": image(plot_estimates(hand), "Ellipses of M, K and B"),
                }
            ),
        ]
    )


def shown_comparison(compared: Comparison) -> Any:
    """The picture and the tables."""
    figure = plot_comparison(compared.groups, compared.pairs).figure
    return mo.vstack([image(figure, "Groups that differ"), mo.as_html(compared)])


# What is saved.


def shown_files(
    choice: ChosenAnalysis,
    recording: AnyRecording,
    hand: Estimates | None,
    figure: Any,
    compared: Comparison | None,
) -> Any:
    """Buttons, each of one file."""
    name = choice.path.stem or "session"
    buttons = []
    if hand is not None:
        for ending, label in (("csv", "Table (.csv)"), ("xlsx", "Workbook (.xlsx)")):
            buttons.append(_download(hand.write, f"{name}_hand.{ending}", label))
    if figure is not None:
        for ending in ("png", "svg", "pdf"):
            buttons.append(_figure(figure, f"{name}_ellipses.{ending}", f"Figure (.{ending})"))
    if compared is not None:
        buttons.append(_download(compared.write, f"{name}_differences.csv", "Differences (.csv)"))
    by, command = choice.by, "; ".join(choice.read_lines(choice.path.name))
    buttons.append(
        _download(
            lambda path: write_report(recording, path, by=by, command=command),
            f"{name}_report.html",
            "Report",
        )
    )
    script = choice.script(compared is not None).encode()
    buttons.append(mo.download(script, f"{name}_analysis.py", label="Script (.py)"))
    if "mapping" in choice.reading:
        mapping = Path(choice.reading["mapping"]).read_bytes()
        buttons.append(mo.download(mapping, "columns.toml", label="Mapping (columns.toml)"))
    return mo.hstack(buttons, justify="start", wrap=True)


def _download(write: Callable[[Path], object], name: str, label: str) -> Any:
    """A file that is made when it is asked for."""
    return mo.download(lambda: written(write, name), name, label=label)


def _figure(figure: Any, name: str, label: str) -> Any:
    ending = Path(name).suffix[1:]
    return _download(lambda path: save(figure, path.with_suffix(""), [ending]), name, label)


def session_folder() -> TemporaryDirectory[str]:
    """A folder of this visit's own, removed with it."""
    return TemporaryDirectory(prefix="armimpedance-")
