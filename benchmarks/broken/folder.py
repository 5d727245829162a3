"""The pages of the study: tables by topic, and a first page that leads there by symptom."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

HEAD: Final = (
    "| what is wrong | effect | you will see | what to do |",
    "| --- | --- | --- | --- |",
)
#: Violations of sensors, units and files; the others are of the person, the rig or the limb.
_SENSORS: Final = re.compile(
    r"(torque in|torque clipped|torque's|torque sensor|angle in|gain|channels|samples"
    r"|every trial|hum|force|position|sensor|one axis|onsets|one long trial|handle's)"
)
FIRST: Final = (
    "# What can go wrong, and what you will see",
    "",
    "A warning or a refusal of a command begins with a name, such as `reflex: ...`. Look that",
    "name up here. The table lists the faults that caused the message. The pages say what",
    "else you will see, and what to do.",
    "",
    "What changes in a session (a gain, a channel, the person, labels) and what was filtered",
    "before it was saved are on [their own page](../../explanation/sessions_and_filters.md).",
    "",
)
PERSON, SENSORS, ALL = "person and rig", "sensors and units", "all"


@dataclass(frozen=True)
class Topic:
    """A page: its title, its name in a table, and which part of which commands' tables it holds."""

    title: str
    short: str
    tables: tuple[tuple[str, str], ...]


TOPICS: Final = {
    "joint": Topic("One joint: person and rig", "joint", (("elbow", PERSON),)),
    "joint_sensors": Topic("One joint: sensors and units", "joint: sensors", (("elbow", SENSORS),)),
    "joint_over_time": Topic(
        "One joint over time, and EMG",
        "joint over time",
        (("elbow --time-varying", ALL), ("elbow --emg-law", ALL)),
    ),
    "hand": Topic("The hand: person and rig", "hand", (("estimate", PERSON), ("reflex", ALL))),
    "hand_sensors": Topic("The hand: sensors and units", "hand: sensors", (("estimate", SENSORS),)),
    "hand_around": Topic(
        "The hand: looking, mapping, comparing",
        "hand: around",
        (("inspect", ALL), ("map", ALL), ("compare", ALL)),
    ),
    "hand_moving": Topic(
        "The hand under random perturbations, and while it reaches",
        "hand: moving",
        (("random", ALL), ("movement", ALL)),
    ),
    "relaxed": Topic("Relaxed joints", "relaxed", (("passive", ALL),)),
    "bodies_and_therapy": Topic(
        "Bodies and therapy robots",
        "bodies, therapy",
        tuple((c, ALL) for c in ("body", "therapy robot", "therapy arm", "therapy contribution")),
    ),
    "muscles_and_files": Topic(
        "Muscles, and exams that are converted",
        "muscles, files",
        (("fit activation", ALL), ("fit moment-arms", ALL), ("convert", ALL)),
    ),
}


def pages(intro: list[str], tables: dict[str, list[str]], clean: list[str]) -> dict[str, str]:
    """Name of a page -> its text, from the tables' lines by command."""
    found = {"good_records": _text(["# Records with nothing wrong", "", *clean])}
    where: dict[str, list[str]] = {}
    for name, topic in TOPICS.items():
        lines = [f"# What can go wrong: {topic.title}", ""]
        lines += ["What the columns mean is on [the first page](index.md).", ""]
        for command, part in topic.tables:
            chosen = [row for row in tables.get(command, []) if _belongs(row, part)]
            if chosen:
                lines += [f"## `{command}`", "", *HEAD, *chosen, ""]
                where.setdefault(name, []).extend(chosen)
        if name in where:
            found[name] = _text(lines)
    listed = [f"- [{TOPICS[name].title}]({name}.md)" for name in where]
    listed += ["- [Records with nothing wrong](good_records.md): false alarms", ""]
    first = [*FIRST, *_symptoms(where), "## By topic", "", *listed, "## How it was measured", ""]
    found["index"] = _text([*first, *intro])
    return found


def _symptoms(where: dict[str, list[str]]) -> Iterator[str]:
    """Tables by what a user reads: the first words of a message, or no word at all."""
    said: dict[str, list[tuple[str, str]]] = {}
    silent: list[tuple[str, str]] = []
    for page, rows in where.items():
        for row in rows:
            what, _, seen, *_ = row.removeprefix("| ").split(" | ")
            cause = (what.split(",")[0], page)
            for name in dict.fromkeys(_names(seen)):
                said.setdefault(name, []).append(cause)
            if "**in" in seen:
                silent.append(cause)
    yield from ("## By message", "")
    yield from (
        "| the message begins with | what was broken | pages |",
        "| --- | --- | --- |",
    )
    for name in sorted(said):
        yield _symptom(f"`{name}`", said[name])
    if silent:
        yield _symptom("no message, and the number is wrong", silent)
    yield ""


def _symptom(name: str, causes: list[tuple[str, str]]) -> str:
    what = "; ".join(dict.fromkeys(cause for cause, _ in causes))
    pages_ = ", ".join(f"[{TOPICS[p].short}]({p}.md)" for p in dict.fromkeys(p for _, p in causes))
    return f"| {name} | {what} | {pages_} |"


def _names(seen: str) -> list[str]:
    """Names of checks in a cell: `*reflex: ...*` of a warning, `"units: ...` of a refusal."""
    warned = re.findall(r"a warning in \d+ %: \*([^:*]+)[:*]", seen)
    refused = re.findall(r'refused in \d+ %: "([a-zA-Z ]{3,20}):', seen)
    return [name for name in [*warned, *refused] if len(name.split()) <= 3]


def _belongs(row: str, part: str) -> bool:
    sensors = bool(_SENSORS.match(row.removeprefix("| ")))
    return part == ALL or (part == SENSORS) == sensors


def _text(lines: list[str]) -> str:
    return "\n".join(lines).rstrip() + "\n"
