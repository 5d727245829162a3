"""Check the faces: every name is documented in numpydoc's sections, has an example, and it runs."""

from __future__ import annotations

import ast
import doctest
import importlib
import inspect
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from numpydoc.validate import validate

# One thread for the matrix libraries, as everywhere: more of them wait for each other.
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "docs/_site"))
from faces import EXAMPLE, names_without_an_example  # noqa: E402

#: No docstring; parameters not documented, unknown, in another order; no section of returns.
ERRORS = {"GL08", "PR01", "PR02", "PR03", "RT01"}
#: What every name at the very top must have beside: parameters and returns described, an example.
ERRORS_AT_THE_TOP = {*ERRORS, "PR07", "RT03", "EX01"}
#: Of the parts that forms are put together from, which no user imports: a sentence.
ERRORS_OF_FORMS = {"GL08"}


def faces() -> Iterator[tuple[str, str]]:
    """(Room, name) of every name on a face of the analysis, the face of the whole first."""
    stubs = sorted(ROOT.glob("armimpedance/**/__init__.pyi"), key=lambda p: (len(p.parts), p))
    for stub in filter(Path.exists, stubs):
        room = ".".join(stub.parent.relative_to(ROOT).parts)
        for node in ast.walk(ast.parse(stub.read_text())):
            if isinstance(node, ast.ImportFrom):
                yield from ((room, alias.name) for alias in node.names)


def is_ours(thing: Any) -> bool:
    """Whether it is a function or class of this package."""
    known = inspect.isfunction(thing) or inspect.isclass(thing)
    return known and thing.__module__.startswith("armimpedance")


def undocumented(room: str, name: str) -> Iterator[str]:
    """What numpydoc finds wrong with the docstring of a name."""
    thing = getattr(importlib.import_module(room), name)
    if not is_ours(thing):
        return
    importlib.import_module(thing.__module__)
    if inspect.isclass(thing):
        if not (thing.__doc__ or "").strip() or thing.__doc__.startswith(f"{name}("):
            yield f"{room}.{name}: no docstring"
        return
    forms = ".show." in f"{thing.__module__}."
    wanted = ERRORS_OF_FORMS if forms else ERRORS
    wanted = ERRORS_AT_THE_TOP if room == "armimpedance" else wanted
    for code, message in validate(f"{thing.__module__}.{thing.__qualname__}")["errors"]:
        if code in wanted:
            yield f"{room}.{name}: {code} {message}"


def failing_examples(room: str, name: str) -> Iterator[str]:
    """Examples in the docstring of a name, run as doctests."""
    thing = getattr(importlib.import_module(room), name)
    if not is_ours(thing):
        return
    tests = doctest.DocTestFinder(recurse=False).find(thing, name, globs={})
    yield from failing(f"{room}.{name}", tests)


def failing_example_of_the_index() -> Iterator[str]:
    """The example on the API's first page, run in a folder of its own."""
    test = doctest.DocTestParser().get_doctest(EXAMPLE, {}, "EXAMPLE", None, None)
    with TemporaryDirectory() as folder, chdir(folder):
        yield from failing("faces.EXAMPLE", [test])


def failing(where: str, tests: list[doctest.DocTest]) -> Iterator[str]:
    """What doctest says of examples that print something else."""
    said: list[str] = []
    runner = doctest.DocTestRunner(
        verbose=False, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    )
    for test in tests:
        runner.run(test, out=said.append)
    if said:
        yield f"{where}: {' '.join(''.join(said).split())}"


def remember_sessions() -> None:
    """Simulate a session once only that several examples use: recordings are read-only."""
    for room in sorted(ROOT.glob("manipulandum_sim/*/__init__.pyi")):
        module = importlib.import_module(f"manipulandum_sim.{room.parent.name}")
        for name in module.__all__:
            simulator = getattr(module, name)
            if name.startswith("simulate") and inspect.isfunction(simulator):
                setattr(module, name, remembered(simulator))


def remembered(simulator: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, which answers a call that it knows from memory."""
    known: dict[str, Any] = {}

    def answer(*args: Any, **options: Any) -> Any:
        call = repr((args, sorted(options.items())))
        if call not in known:
            known[call] = simulator(*args, **options)
        return known[call]

    return answer


def main() -> int:
    """Print every problem; 1 if there is any."""
    every = list(faces())
    problems = [problem for room, name in every for problem in undocumented(room, name)]
    problems += [f"{name}: no example, and no use" for name in names_without_an_example()]
    remember_sessions()
    begun = time.process_time()
    seen = set()
    for room, name in every:
        thing = getattr(importlib.import_module(room), name)
        if id(thing) not in seen:
            problems += failing_examples(room, name)
        seen.add(id(thing))
    problems += failing_example_of_the_index()
    for problem in problems:
        print(problem)
    seconds = time.process_time() - begun
    print(f"faces: {len(every)} names, {len(problems)} problems; examples took {seconds:.0f} s")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
