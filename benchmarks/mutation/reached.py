"""Which tests reach which lines, and what they cost: what `mutation_score.py` chooses tests by."""

from __future__ import annotations

import json
import time
from collections import Counter, defaultdict
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import Any

import coverage
import pytest
from mutation.mutants import ROOMS, Mutant, room_of

# As `make test`: without the studies.
QUIET = ["-q", "-p", "no:cacheprovider", "-o", "addopts=", "-m", "not study"]


class Recorder:
    """A pytest plugin that tells coverage which test, or which shared fixture, is running."""

    def __init__(self, measured: coverage.Coverage) -> None:
        self.measured, self.context = measured, ""
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.needs: dict[str, list[str]] = {}
        self.failed: set[str] = set()

    def within(self, context: str) -> Generator[None]:
        """Everything until the hook goes on belongs to this context."""
        outer, self.context, start = self.context, context, time.perf_counter()
        self.measured.switch_context(context)
        yield
        spent = time.perf_counter() - start
        self.seconds[context] += spent
        self.seconds[outer] -= spent
        self.context = outer
        self.measured.switch_context(outer)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Generator[None]:
        """Measure a test under its own name, and remember the shared fixtures it needs."""
        fixtures = [f[-1] for f in item._fixtureinfo.name2fixturedefs.values()]
        self.needs[item.nodeid] = [_name(f) for f in fixtures if f.scope != "function"]
        yield from self.within(item.nodeid)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Generator[None]:
        """Measure a shared fixture under its own name, whichever test needs it first."""
        if fixturedef.scope == "function":
            yield
        else:
            yield from self.within(_name(fixturedef))

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Remember the tests that fail without any mutant; they are never chosen."""
        if not report.passed:
            self.failed.add(report.nodeid)


def _name(fixture: Any) -> str:
    return f"{fixture.baseid}::fixture {fixture.argname}"


def measure(root: Path, out: Path, files: list[str], rooms: Sequence[str]) -> int:
    """Run test files under coverage; write who reaches what, in how long, as JSON."""
    include = [f"{root}/armimpedance/{room}/*" for room in rooms]
    measured = coverage.Coverage(data_file=None, include=include, config_file=False, messages=False)
    measured.start()
    recorder = Recorder(measured)
    pytest.main([*QUIET, *files], plugins=[recorder])
    measured.stop()
    data = measured.get_data()
    reached = {
        str(Path(f).relative_to(root)): data.contexts_by_lineno(f) for f in data.measured_files()
    }
    out.write_text(
        json.dumps(
            {
                "reached": reached,
                "needs": {t: n for t, n in recorder.needs.items() if t not in recorder.failed},
                "seconds": recorder.seconds,
                "failed": sorted(recorder.failed),
            }
        )
    )
    return 0


class Tests:
    """Which tests reach which lines, and what they cost."""

    def __init__(self, parts: list[dict[str, Any]]) -> None:
        self.seconds: Counter[str] = Counter()
        self.needs: dict[str, list[str]] = {}
        self.reached: defaultdict[str, defaultdict[int, set[str]]]
        self.reached = defaultdict(lambda: defaultdict(set))
        for part in parts:
            self.seconds.update(part["seconds"])
            self.needs |= part["needs"]
            for file, lines in part["reached"].items():
                for line, contexts in lines.items():
                    self.reached[file][int(line)] |= set(contexts)

    def cost(self, test: str, ready: set[str]) -> float:
        """Seconds of a test and of those of its fixtures that are not ready."""
        return sum(self.seconds[c] for c in {test, *self.needs[test]} - ready)

    def chosen(self, mutant: Mutant, budget: float) -> tuple[list[str], float]:
        """The cheapest tests that reach a mutant, its own room's first, and their seconds."""
        lines = self.reached[mutant.file]
        contexts = set().union(*(lines[k] for k in mutant.lines))
        tests = [t for t, needs in self.needs.items() if not contexts.isdisjoint({t, *needs})]
        ready: set[str] = set()
        taken, total = [], 0.0
        for test in sorted(tests, key=lambda t: self.cost(t, set())):
            seconds = self.cost(test, ready)
            if not taken or total + seconds <= budget:
                taken.append(test)
                total += seconds
                ready |= {*self.needs[test]}
        room = f"/{ROOMS[room_of(mutant.file)]}"
        price: Counter[str] = Counter()
        for test in taken:
            price[test.split("::")[0]] += self.cost(test, set())
        modules = sorted(price, key=lambda m: (room not in m, price[m]))
        return [t for m in modules for t in taken if t.split("::")[0] == m], total
