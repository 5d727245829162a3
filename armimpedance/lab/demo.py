"""The whole study on a simulated subject: three experiments, estimates, models, figures.

Examples:
  armimpedance demo --quick
  armimpedance demo --out study --subject C

Writes recordings (with their truth), hand.csv, joint.csv, models over posture and activation,
summary.txt and Figs 6-14 and both tables of Tsuji (1997) to the folder, and compares estimates and
models with the truth on the screen. It ends in explore.html, an arm to play with, and in
report.html, a page of all conditions. What an earlier demo wrote there is replaced.
--quick takes two sets of disturbances instead of five, a part of the conditions (figures that need
more of them are left out), and writes figures as PNG only.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.lab.parts.simulation import simulated_files, write_simulated
from armimpedance.show.command.outputs import OutputPath, check_folder, check_seed

if TYPE_CHECKING:
    from concurrent.futures import Future

    from armimpedance.core.workers import Crew
    from armimpedance.lab.parts.demo_models import DemoModel
    from armimpedance_figures.tsuji1997.every import Drawn
    from armimpedance_figures.tsuji1997.study import StudiedExperiment

#: Each draws with a library of its own in memory.
MOST_WORKERS = 4
EXPERIMENTS = ("postures", "cocontraction", "force")
LONGEST_FIRST = ("force", "postures", "cocontraction")


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--out", type=OutputPath, default=Path("armimpedance_demo"), metavar="DIR")
    parser.add_argument("--quick", action="store_true", help="fewer disturbances and conditions")
    parser.add_argument("--subject", default="A", help="simulated subject, A (default) to D")
    parser.add_argument("--seed", type=int, default=1997)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, estimate, map, draw, and compare with the truth."""
    from armimpedance.core.workers import crew, usable_cores

    check_seed(arguments.seed)
    for name in EXPERIMENTS:
        check_folder(arguments.out / "recordings" / name, simulated_files(), replace=True)
    print(f"Simulated subject {arguments.subject}: three experiments of Tsuji (1997)", flush=True)
    with crew(min(usable_cores(), MOST_WORKERS)) as workers:
        studied = _study_all(arguments, workers)
        lines = _write_all(studied, arguments.out, workers, quick=arguments.quick)
    print("\n".join(lines))
    return 0


def _study_all(arguments: argparse.Namespace, workers: Crew) -> dict[str, StudiedExperiment]:
    subject, seed, sets = arguments.subject, arguments.seed, 2 if arguments.quick else 5
    pieces = []
    for name in LONGEST_FIRST:
        conditions = _quick_conditions(name, subject) if arguments.quick else None
        out = arguments.out / "recordings" / name
        pieces.append(workers.share(_studied, name, subject, seed, sets, conditions, out))
    results = dict(zip(LONGEST_FIRST, workers.finish(pieces), strict=True))
    for name in EXPERIMENTS:
        print(f"  {name}: {len(results[name].trials)} disturbances", flush=True)
    return {name: results[name] for name in EXPERIMENTS}


def _studied(
    name: str, subject: str, seed: int, sets: int, conditions: list[str] | None, out: Path
) -> StudiedExperiment:
    """One experiment: its recording is written here, and only what is drawn from goes on."""
    from armimpedance_figures.tsuji1997.every import DRAWN_FROM_SAMPLES
    from armimpedance_figures.tsuji1997.study import study

    studied = study(name, subject=subject, seed=seed, sets=sets, conditions=conditions)
    write_simulated(studied.recording, studied.truth, out)
    return studied if name in DRAWN_FROM_SAMPLES else studied.without_samples()


def _quick_conditions(experiment: str, subject: str) -> list[str]:
    """Conditions that the figures need, and few more."""
    from manipulandum_sim.hand import find_experiment, find_subject

    names = [c.name for c in find_experiment(experiment).conditions(find_subject(subject))]
    every = {"postures": 3, "cocontraction": 2, "force": 1}[experiment]
    return names[::every]


def _write_all(
    studied: Mapping[str, StudiedExperiment], out: Path, workers: Crew, *, quick: bool
) -> list[str]:
    """Draw and fit side by side; what is said of estimates, models and all that was written."""
    from armimpedance.hand.show import write_results
    from armimpedance.lab.parts.demo_models import fit_models, models_text, summary

    lines = [f"{out / 'recordings' / name}: a recording and its truth" for name in studied]
    for level in ("hand", "joint"):
        rows = [e for each in studied.values() for e in getattr(each, level)]
        write_results(rows, out / f"{level}.csv")
        lines.append(f"{out / f'{level}.csv'}: {len(rows)} rows")
    drawings = _draw(studied, out, workers, quick=quick)
    page = workers.share(_report, out)
    models = fit_models(studied)
    text = f"{summary(studied)}\n\n{models_text(models)}"
    lines += _write_models(models, text, out)
    drawn = workers.finish([*drawings, page])[:-1]
    what = "Figs 6-14, Tables 1 and 2 of Tsuji (1997), and where models extrapolate"
    lines.append(f"{out / 'figures'}: {sum(len(one.paths) for one in drawn)} files, {what}")
    left_out = [sentence for one in drawn for sentence in one.left_out]
    return ["", text, "", *lines, *left_out, *_pages(out)]


def _draw(
    studied: Mapping[str, StudiedExperiment], out: Path, workers: Crew, *, quick: bool
) -> list[Future[Drawn]]:
    from armimpedance_figures.source_figure import FORMATS
    from armimpedance_figures.tsuji1997.every import draw_group, in_groups

    formats = ("png",) if quick else FORMATS
    (out / "figures").mkdir(exist_ok=True)
    pieces = in_groups(studied)
    return [workers.share(draw_group, *piece, out / "figures", formats) for piece in pieces]


def _write_models(models: Sequence[DemoModel], text: str, out: Path) -> list[str]:
    """The models, what is said of them, and the arm to play with."""
    from armimpedance.core.outputs import staged_file
    from armimpedance.muscles.models import write_model
    from armimpedance.muscles.show import write_explore

    lines, written = [], []
    for made in models:
        if made.model is not None:
            written.append(out / f"{made.name}.json")
            write_model(made.model, written[-1])
            lines.append(f"{written[-1]}: a model, {made.line}")
    with staged_file(out / "summary.txt") as path:
        path.write_text(text + "\n", encoding="utf-8")
    recording = out / "recordings" / "postures"
    write_explore([*written, out / "hand.csv"], out / "explore.html", recording=recording)
    return lines


def _report(out: Path) -> None:
    """The page of all conditions."""
    from armimpedance.app.report.write import write_report

    command = "armimpedance report hand.csv --out report.html"
    write_report(out / "hand.csv", out / "report.html", command=command)


def _pages(out: Path) -> list[str]:
    return [
        "",
        f"An arm to play with:         {(out / 'explore.html').absolute().as_uri()}",
        f"Open this page in a browser: {(out / 'report.html').absolute().as_uri()}",
    ]
