"""The commands that faults are tried on: what each reads, what it writes, how an old one looks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Case:
    """A command and its outputs.

    Attributes
    ----------
    name : str
    words : tuple of str
        The call, in a folder that holds the inputs; its outputs lie in ``out``.
    outputs : tuple of str
        Names below ``out``, files or folders, each of which is whole or not there.
    mark : str
        Where the outputs are folders, the file by which an earlier one is known.
    """

    name: str
    words: tuple[str, ...]
    outputs: tuple[str, ...]
    mark: str = ""

    @property
    def is_long(self) -> bool:
        """Whether it takes many seconds: it gets fewer kills."""
        return not self.outputs

    def put_old(self, out: Path) -> None:
        """Let an earlier output be there."""
        for name in self.outputs:
            place = out / name
            place.parent.mkdir(parents=True, exist_ok=True)
            if self.mark:
                place.mkdir()
                (place / self.mark).write_text("old")
            else:
                place.write_text("old")


def _case(name: str, call: str, outputs: str, mark: str = "") -> Case:
    return Case(name, tuple(call.split()), tuple(outputs.split()), mark)


#: What the cases read, in the order in which it is made.
INPUTS = (
    "simulate cocontraction --sets 1 --out session",
    "simulate postures --sets 1 --out postures",
    "estimate session --out hand.csv",
    "estimate postures --out places.csv",
    "map places.csv --recording postures --to joint --out joint.csv",
    "simulate cocontraction --sets 1 --as kinarm --out exam",
)

RECORDING = "recording.json"
CASES = (
    _case("table", "estimate session --out out/r.csv", "r.csv"),
    _case("workbook", "estimate session --out out/r.xlsx", "r.xlsx"),
    _case("MATLAB", "estimate session --out out/r.mat", "r.mat"),
    _case("Parquet", "estimate session --out out/r.parquet", "r.parquet"),
    _case("JSON", "estimate session --out out/r.json", "r.json"),
    _case(
        "table and pictures",
        "estimate session --out out/r.csv --figure out/f.pdf",
        "r.csv f.pdf f.txt f_motion.pdf f_motion.txt",
    ),
    _case("PNG", "estimate session --figure out/f.png", "f.png f.txt f_motion.png f_motion.txt"),
    _case("differences", "compare hand.csv --out out/c.csv --figure out/c.svg", "c.csv c.svg"),
    _case("model", "fit moment-arms joint.csv --order 1 --out out/m.json", "m.json"),
    _case("page", "report hand.csv --out out/r.html", "r.html"),
    _case("arm in a page", "explore hand.csv --out out/e.html", "e.html"),
    _case("data sheet", "share session --as datasheet --replace --out out/D.md", "D.md"),
    _case("recording", "convert exam/exam.kinarm out/s --replace", "s", RECORDING),
    _case("recording in CSV", "convert session out/s --table csv --replace", "s", RECORDING),
    _case(
        "simulated",
        "simulate cocontraction --sets 1 --seed 3 --replace --out out/s",
        "s",
        RECORDING,
    ),
    _case("starter", "new --for custom --replace out/s", "s", "analysis.py"),
    _case("starter, Kinarm", "new --for kinarm --replace out/s", "s", "analysis.py"),
    _case(
        "BIDS",
        "share session --as bids --replace --out out/d",
        "d",
        "dataset_description.json",
    ),
    _case("figures", "figures --only fig06_motion --out out/figures", ""),
    _case("demo", "demo --quick --out out/study", ""),
)
