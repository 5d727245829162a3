# /// script
# [tool.marimo.display]
# theme = "system"
# ///
"""The page: one cell a step; what a step depends on, runs it anew."""

# ruff: noqa: B018 - the last line of a cell is what it shows
# mypy: ignore-errors
import marimo

app = marimo.App(width="medium", app_title="armimpedance")


@app.cell
def _():
    from pathlib import Path

    import marimo as mo

    import armimpedance as ai
    from armimpedance.app.interactive import views
    from armimpedance.app.interactive.choice import ChosenAnalysis, groupings, questions_of
    from armimpedance.recordings import is_recording

    mo.md("# Impedance of the arm\nFrom a recording to a report, on this machine alone.")
    return ChosenAnalysis, Path, ai, groupings, is_recording, mo, questions_of, views


@app.cell
def _(Path, is_recording, mo, views):
    folder = views.session_folder()
    _asked = Path(mo.query_params().get("path") or ".")
    _place = _asked if _asked.is_dir() and not is_recording(_asked) else _asked.parent
    browser = mo.ui.file_browser(
        _place, selection_mode="all", multiple=False, restrict_navigation=False
    )
    opened_first = None if _place == _asked else _asked
    return browser, folder, opened_first


@app.cell
def _(browser, mo, opened_first):
    path = browser.path(0) or opened_first
    mo.vstack([mo.md("## 1 Choose a recording"), browser])
    return (path,)


@app.cell
def _(mo, path, questions_of, views):
    mo.stop(path is None, mo.md("Nothing is chosen yet: a file, or a folder of trials."))
    questions = questions_of(path)
    form = views.form_of(questions)
    return form, questions


@app.cell
def _(form, path, questions, views):
    views.shown_form(path, form, questions)
    return


@app.cell
def _(Path, ai, folder, form, mo, path, views):
    reading = views.reading_of(form.value, Path(folder.name))
    recording, _refused = views.attempt(lambda: ai.read(path, **reading))
    mo.stop(recording is None, _refused)
    return reading, recording


@app.cell
def _(ai, mo, path, recording, views):
    inspection = ai.inspect(recording, title=path.name)
    mo.vstack([mo.md("## 2 Look at it"), views.shown_inspection(inspection)])
    return


@app.cell
def _(ai, mo, recording, views):
    is_hand = isinstance(recording, ai.Recording) and recording.kind == "hand"
    trials = views.trial_table(recording) if is_hand else None
    mo.accordion(views.shown_trials(recording, trials)) if is_hand else None
    return is_hand, trials


@app.cell
def _(groupings, is_hand, mo, recording):
    mo.stop(not is_hand)
    _names = recording.trials["condition"].unique().tolist()
    choosing = mo.ui.dictionary(
        {
            "by": mo.ui.multiselect(
                groupings(recording.trials), ["condition"], label="One estimate for each"
            ),
            "conditions": mo.ui.multiselect(_names, label="Conditions (none chosen: all)"),
        }
    )
    return (choosing,)


@app.cell
def _(ChosenAnalysis, choosing, form, is_hand, path, reading, trials):
    _left_out = trials.value["trial"].tolist() if is_hand else []
    _groups = choosing.value if is_hand else {}
    choice = ChosenAnalysis(
        path,
        reading,
        form.value["handle_mass_kg"] or None,
        tuple(_groups.get("by") or ["condition"]),
        tuple(_groups.get("conditions", ())),
        tuple(_left_out),
    )
    return (choice,)


@app.cell
def _(choosing, is_hand, mo):
    mo.stop(not is_hand)
    estimating = mo.ui.run_button(label="Estimate", kind="success")
    mo.vstack([mo.md("## 3 Estimate"), *choosing.elements.values(), estimating])
    return (estimating,)


@app.cell
def _(choice, estimating, mo, recording, views):
    mo.stop(not estimating.value)
    kept, _refused = views.attempt(lambda: choice.keep(recording))
    mo.stop(kept is None, _refused)
    hand, _refused = views.attempt(lambda: views.estimated(kept, choice))
    mo.stop(hand is None, _refused)
    return hand, kept


@app.cell
def _(ai, hand, views):
    figure = ai.plot_ellipses(hand).figure
    views.shown_estimates(hand, figure)
    return (figure,)


@app.cell
def _(hand, mo):
    comparing = mo.ui.run_button(label="Compare the groups")
    comparing if len(hand) > 1 else None
    return (comparing,)


@app.cell
def _(choice, comparing, kept, views):
    compared, _refused = None, None
    if comparing.value:
        compared, _refused = views.attempt(lambda: views.compared(kept, choice))
    _refused if compared is None else views.shown_comparison(compared)
    return (compared,)


@app.cell
def _(choice, compared, figure, hand, kept, mo, views):
    mo.vstack([mo.md("## 4 Save"), views.shown_files(choice, kept, hand, figure, compared)])
    return


@app.cell
def _(choice, is_hand, mo, recording, views):
    mo.stop(is_hand)
    mo.vstack(
        [
            mo.md("## 3 Save\nThe report has the analysis that belongs to such a recording."),
            views.shown_files(choice, recording, None, None, None),
        ]
    )
    return


if __name__ == "__main__":
    app.run()
