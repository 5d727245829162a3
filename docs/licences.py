"""List the licences of everything that requirements.lock installs, as each package declares them.

Run it after the lock has changed. `--check` compares the page with the lock and writes nothing;
`--bill FILE` compares a bill of materials with the lock.
"""

from __future__ import annotations

import json
import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Final

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/project/licences.md"

#: Packages that declare nothing, and what the licence file in their distribution says.
FROM_THEIR_FILES: Final = {"cmeel-qhull": "Qhull (as BSD, with notice of changes)", "ezc3d": "MIT"}

HEAD = """# Licences

armimpedance is under the BSD-3-Clause licence. Here stands what it needs, in the exact versions of
`requirements.lock`, with the licence that each package declares. Libraries inside a package may
have licences of their own, which the package's files name.

The lock holds the checksum (SHA-256) of every file of these versions, and the set-up installs no
other file. `make bill` writes a bill of materials in the form of CycloneDX (versions, licences, who
needs whom) to `out/armimpedance.cdx.json`. `docs/licences.py` writes this page; continuous
integration compares the page and the bill with the lock.

The package itself holds three files of others, unchanged: Vega, Vega-Lite and Vega-Embed
(BSD-3-Clause), which draw the pictures of a report in the browser. Their versions, checksums and
the licences of all that they hold stand beside them, in
`armimpedance/show/pages/assets/vega/LICENSES.txt`.
"""
#: Title of a part of the page -> what stands below it.
PARTS: Final = {
    "To use it": "`pip install armimpedance` brings these.",
    "Extras": "For some files and for many machines: `pip install armimpedance[all]`.",
    "To develop it": "Tests, types and documentation. No user needs them.",
}


def locked() -> dict[str, str]:
    """Version of every package in the lock, by its normal name."""
    pins = re.findall(r"^([\w.-]+)==(\S+)", (ROOT / "requirements.lock").read_text(), re.MULTILINE)
    return {canonicalize_name(name): version for name, version in pins}


def needed(extra: str = "") -> set[str]:
    """Packages that armimpedance with an extra needs, directly or through others."""
    waiting = [Requirement(f"armimpedance[{extra}]" if extra else "armimpedance")]
    seen: set[tuple[str, str]] = set()
    while waiting:
        asked = waiting.pop()
        name = canonicalize_name(asked.name)
        for extra in {"", *asked.extras} - {extra for known, extra in seen if known == name}:
            seen.add((name, extra))
            waiting += _required(name, extra)
    return {name for name, _ in seen} - {"armimpedance"}


def _required(name: str, extra: str) -> list[Requirement]:
    lines = map(Requirement, metadata.requires(name) or [])
    return [one for one in lines if one.marker is None or one.marker.evaluate({"extra": extra})]


def licence(name: str) -> str:
    """What an installed package declares: an expression, a short text, or its classifiers."""
    declared = metadata.metadata(name).json
    expression, text = str(declared.get("license_expression", "")), str(declared.get("license", ""))
    classes = [
        entry.rpartition(" :: ")[2]
        for entry in declared.get("classifier", [])
        if entry.startswith("License ::")
    ]
    short = text.strip() if 0 < len(text.strip()) <= 60 and "\n" not in text.strip() else ""
    found = expression or short or ", or ".join(classes) or FROM_THEIR_FILES.get(name)
    if not found:
        raise SystemExit(f"{name} declares no licence: look it up and name it in docs/licences.py")
    return found


def page() -> str:
    """The whole page."""
    pins = locked()
    use = needed()
    extras = needed("all") - use
    members = [use, extras, set(pins) - use - extras]
    if missing := (use | extras) - set(pins):
        raise SystemExit(f"not in requirements.lock: {', '.join(sorted(missing))}")
    text = HEAD
    for (title, about), names in zip(PARTS.items(), members, strict=True):
        rows = [f"| {name} | {_version(name, pins)} | {licence(name)} |" for name in sorted(names)]
        text += f"\n## {title}\n\n{about}\n\n| package | version | licence |\n| --- | --- | --- |\n"
        text += "\n".join(rows) + "\n"
    return text


def _version(name: str, pins: dict[str, str]) -> str:
    if metadata.version(name) != pins[name]:
        raise SystemExit(
            f"{name} {metadata.version(name)} is installed, not {pins[name]}: make setup"
        )
    return pins[name]


def check_bill(file: Path) -> None:
    """Every package of the lock stands in the bill of materials, in its version."""
    bill = json.loads(file.read_text())
    listed = {(canonicalize_name(one["name"]), one["version"]) for one in bill["components"]}
    if missing := set(locked().items()) - listed:
        raise SystemExit(f"{file} does not hold {', '.join(name for name, _ in sorted(missing))}")


def main(arguments: list[str]) -> None:
    """Write the page, or compare."""
    if "--bill" in arguments:
        check_bill(Path(arguments[-1]))
        return
    text = page()
    if "--check" in arguments:
        if PAGE.read_text() != text:
            raise SystemExit(
                "docs/project/licences.md is not what the lock says: run docs/licences.py"
            )
    else:
        PAGE.write_text(text)


if __name__ == "__main__":
    main(sys.argv[1:])
