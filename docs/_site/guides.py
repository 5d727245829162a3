"""Lists of the pages in docs/ by what they are about; a page that nobody lists stands in the last.

A topic is a page or a folder with an index: `plan.md`, `muscles/index.md`.
"""

from __future__ import annotations

from pathlib import Path

from rst import title, toctree

#: Page -> (title, what it says, topics: the names of pages or of their folders).
GROUPS = {
    "guides/data": (
        "Getting data in",
        "Every file is read by one door; what is not taken is named.",
        (
            "starters",
            "kinarm",
            "mapping",
            "exports",
            "sources",
            "sharing",
            "motion_capture",
            "opensim",
        ),
    ),
    "guides/hand": (
        "The hand",
        "From pushes to inertia, viscosity and stiffness, before, during and after an experiment.",
        (
            "plan",
            "estimate",
            "reflex",
            "compare",
            "movement",
            "random",
            "random_accuracy",
            "space",
            "space_wrist",
            "live",
        ),
    ),
    "guides/muscles": ("Muscles", "Models over posture and muscle activation.", ("muscles",)),
    "guides/joints": (
        "One joint, relaxed joints, bodies",
        "A joint under a random perturbation, a relaxed joint, masses and inertias.",
        ("elbow", "random_joints", "passive", "body"),
    ),
    "guides/therapy": ("Therapy robots", "How much of a movement is the patient's.", ("therapy",)),
    "guides/results": (
        "Results, studies and pages to show",
        "From one session to a cohort, a workbook or a paper.",
        ("report", "app", "results_files", "figures", "study", "simulate_study"),
    ),
    "guides/trust": (
        "How far to trust it",
        "What breaks a result, what was measured, and who does it better.",
        (
            "what_can_go_wrong",
            "robustness",
            "peers",
            "benchmark",
            "benchmark_rows",
            "benchmark_table",
        ),
    ),
    "guides/project": (
        "The project",
        "How it is built, and how to add to it.",
        ("data_flow", "conventions", "extending", "licences"),
    ),
}
#: What has its own place in the site.
ELSEWHERE = {"index", "README", "gallery", "changelog", "search"}
FOLDERS_ELSEWHERE = {"tutorials", "how_to", "theory", "reference", "guides", "gallery"}


def guide_pages(source: Path) -> dict[str, str]:
    """Name of a page -> its text."""
    left = _pages(source)
    pages = {}
    for name, (heading, what, topics) in GROUPS.items():
        listed = [page for topic in topics for page in left if page.split("/")[0] == topic]
        left = [page for page in left if page not in listed]
        if name == "guides/project":
            listed += left
        pages[name] = _list(heading, what, listed)
    below = [name.removeprefix("guides/") for name in GROUPS]
    pages["guides/index"] = "\n".join(
        [title("Guides"), "The long pages, by what they are about.\n", toctree(below, maxdepth="2")]
    )
    return pages


def _pages(source: Path) -> list[str]:
    """Pages at the top and in the folders of topics; a topic's own page before those below it."""
    found = [p.relative_to(source).with_suffix("") for p in source.rglob("*.md")]
    names = [str(p) for p in found if not p.parts[0].startswith(("_", "."))]
    ours = [n for n in names if n not in ELSEWHERE and n.split("/")[0] not in FOLDERS_ELSEWHERE]
    return sorted(ours, key=lambda n: (n.split("/")[0], not n.endswith("/index"), n))


def _list(heading: str, what: str, pages: list[str]) -> str:
    return "\n".join([title(heading), what, "", toctree([f"/{p}" for p in pages], maxdepth="1")])
