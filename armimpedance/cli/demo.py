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

from armimpedance.cli.parts.checks import check_seed
from armimpedance.cli.parts.outputs import check_folder
from armimpedance.cli.parts.simulation import simulated_files, write_simulated

if TYPE_CHECKING:
    from armimpedance.cli.parts.demo_models import DemoModel
    from armimpedance_figures.tsuji1997.study import StudiedExperiment

#: Each draws with a library of its own in memory.
MOST_WORKERS = 4
EXPERIMENTS = ("postures", "cocontraction", "force")


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--out", type=Path, default=Path("armimpedance_demo"), metavar="DIR")
    parser.add_argument("--quick", action="store_true", help="fewer disturbances and conditions")
    parser.add_argument("--subject", default="A", help="simulated subject, A (default) to D")
    parser.add_argument("--seed", type=int, default=1997)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, estimate, map, draw, and compare with the truth."""
    from armimpedance.cli.parts.demo_models import fit_models, models_text
    from armimpedance.cli.parts.demo_summary import summary

    check_seed(arguments.seed)
    for name in EXPERIMENTS:
        check_folder(arguments.out / "recordings" / name, simulated_files(), replace=True)
    print(f"Simulated subject {arguments.subject}: three experiments of Tsuji (1997)")
    studied = _study_all(arguments)
    arguments.out.mkdir(parents=True, exist_ok=True)
    models = fit_models(studied)
    text = f"{summary(studied)}\n\n{models_text(models)}"
    lines = _write_all(studied, models, arguments.out, text, quick=arguments.quick)
    print("\n".join(["", text, "", *lines]))
    return 0


def _study_all(arguments: argparse.Namespace) -> dict[str, StudiedExperiment]:
    from armimpedance.cli.parts.progress import bar
    from armimpedance_figures.tsuji1997.study import study

    studied = {}
    for name in EXPERIMENTS:
        with bar(f"{name}: estimating") as progress:
            studied[name] = study(
                name,
                subject=arguments.subject,
                seed=arguments.seed,
                sets=2 if arguments.quick else 5,
                conditions=_quick_conditions(name, arguments.subject) if arguments.quick else None,
                progress=progress,
            )
        print(f"  {name}: {studied[name].recording.n_trials} disturbances", flush=True)
    return studied


def _quick_conditions(experiment: str, subject: str) -> list[str]:
    """What the figures need, and little more."""
    from manipulandum_sim.hand import find_experiment, find_subject

    names = [c.name for c in find_experiment(experiment).conditions(find_subject(subject))]
    every = {"postures": 3, "cocontraction": 2, "force": 1}[experiment]
    return names[::every]


def _write_all(
    studied: Mapping[str, StudiedExperiment],
    models: Sequence[DemoModel],
    out: Path,
    text: str,
    *,
    quick: bool,
) -> list[str]:
    """Write everything; one line per thing written."""
    from armimpedance.files import write_model, write_results
    from armimpedance.outputs import staged_file
    from armimpedance.workers import usable_cores
    from armimpedance_figures.build_all import draw_from
    from armimpedance_figures.source_figure import FORMATS

    lines = []
    for name, each in studied.items():
        write_simulated(each.recording, each.truth, out / "recordings" / name)
        lines.append(f"{out / 'recordings' / name}: a recording and its truth")
    for level in ("hand", "joint"):
        rows = [e for each in studied.values() for e in getattr(each, level)]
        write_results(rows, out / f"{level}.csv")
        lines.append(f"{out / f'{level}.csv'}: {len(rows)} rows")
    for made in models:
        if made.model is not None:
            write_model(made.model, out / f"{made.name}.json")
            lines.append(f"{out / f'{made.name}.json'}: a model, {made.line}")
    with staged_file(out / "summary.txt") as path:
        path.write_text(text + "\n", encoding="utf-8")
    (out / "figures").mkdir(exist_ok=True)
    workers = min(usable_cores(), MOST_WORKERS)
    drawn = draw_from(studied, out / "figures", ("png",) if quick else FORMATS, workers)
    what = "Figs 6-14, Tables 1 and 2 of Tsuji (1997), and where models extrapolate"
    lines.append(f"{out / 'figures'}: {len(drawn.paths)} files, {what}")
    return [*lines, *drawn.left_out, *_report(out)]


def _report(out: Path) -> list[str]:
    """The arm to play with, and the page of all conditions, last of what was written."""
    from armimpedance.pages import write_explore, write_report

    models = [out / f"{name}.json" for name in ("posture", "activation", "muscles")]
    sources = [*(path for path in models if path.exists()), out / "hand.csv"]
    write_explore(sources, out / "explore.html", recording=out / "recordings" / "postures")
    command = "armimpedance report hand.csv --out report.html"
    write_report(out / "hand.csv", out / "report.html", command=command)
    return [
        "",
        f"An arm to play with:         {(out / 'explore.html').absolute().as_uri()}",
        f"Open this page in a browser: {(out / 'report.html').absolute().as_uri()}",
    ]
