"""A verb is described once: its command, its function, its docstring and the docs agree."""

import argparse
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

from armimpedance.app.cli.main import PLACES, make_parser, run
from armimpedance.core.errors import InputError
from armimpedance.show.verbs.kinds import (
    AnyWord,
    MethodName,
    Milli,
    Number,
    NumberPair,
    OneOf,
    PlaceToRead,
    Switch,
    Whole,
)
from armimpedance.show.verbs.options import Option, Verb


def described():
    """Every verb whose command has a record of its options: command, verb and function."""
    steps = {f"therapy {step}": f"{PLACES['therapy']}.{step}" for step in ("contribution",)}
    for command, place in (PLACES | steps).items():
        for one in vars(importlib.import_module(place)).values():
            if isinstance(one, Verb):
                yield pytest.param(command, one, function_of(one), id=one.name)


def function_of(verb):
    """The Python function: its face is that of the room that describes it."""
    faces = {
        id(face): face
        for name, face in sys.modules.items()
        if name.endswith((".show", "armimpedance")) and verb.name in getattr(face, "__all__", ())
    }
    functions = {getattr(face, verb.name) for face in faces.values()}
    assert len(functions) == 1, verb.name
    return functions.pop()


VERBS = list(described())
BOUNDED = [
    pytest.param(*verb.values, option, id=f"{verb.id}-{option.name}")
    for verb in VERBS
    for option in verb.values[1].options
    if isinstance(option.kind, Number | NumberPair | OneOf | MethodName)
]


#: Commands that need no recording, and those that need more.
ALONE = ("plan",)
_MAPPED = ["--recording", "session", "--out", "mapped.csv", "--to"]
NEEDED = {
    "write_report": ["--out", "page.html"],
    "to_joint": [*_MAPPED, "joint"],
    "to_muscle": [*_MAPPED, "muscle", "--arm", "planar6"],
}


def asking(command, verb):
    """A call of the command without options."""
    return [
        *command.split(),
        *([] if command in ALONE else ["recording"]),
        *NEEDED.get(verb.name, []),
    ]


def wrong(kind: AnyWord) -> tuple:
    """A value that the option must refuse, as a keyword and as words of the command."""
    if isinstance(kind, Number):
        return float("nan"), ["nan"]
    if isinstance(kind, NumberPair):
        return (9.0, 2.0), ["9", "2"]
    return "no such thing", ["no such thing"]


def test_the_verbs_that_were_moved_are_found():
    moved = {"passive", "body", "movement", "random", "estimate", "reflex", "compare"}
    moved |= {"next_trials", "plan", "write_report", "to_joint", "to_muscle"}
    moved |= {"elbow", "elbow_over_time", "emg_law", "contribution"}
    assert {verb.id for verb in VERBS} >= moved


@pytest.mark.parametrize(("command", "verb", "function"), VERBS)
def test_defaults_and_keywords_are_those_of_the_function(command, verb, function):
    keywords = inspect.signature(function).parameters
    for option in verb.options:
        default = inspect.Parameter.empty if option.required else option.default
        assert keywords[option.name].default == default, f"{command}: {option.name}"
        assert keywords[option.name].kind is inspect.Parameter.KEYWORD_ONLY


@pytest.mark.parametrize(("command", "verb", "function"), VERBS)
def test_a_call_without_options_asks_for_the_defaults(command, verb, function):
    needed = [option for option in verb.options if option.required]
    words = [word for option in needed for word in (option.command, "there")]
    asked = make_parser(command.split()).parse_args([*asking(command, verb), *words])
    given = {option.name: option.default for option in verb.options}
    given |= {option.name: Path("there") for option in needed}
    assert verb.keywords(asked) == given, function.__name__


@pytest.mark.parametrize(("command", "verb", "function"), VERBS)
def test_the_docstring_has_a_line_for_every_keyword(command, verb, function):
    assert "{options}" not in function.__doc__, command
    for option in verb.options:
        assert f"\n{option.name} : " in function.__doc__


@pytest.mark.parametrize(("command", "verb", "function", "option"), BOUNDED)
def test_bounds_hold_at_both_doors_before_anything_is_read(
    command, verb, function, option, tmp_path, capsys
):
    value, words = wrong(option.kind)
    read = [] if command in ALONE else [tmp_path / "nothing"]
    needed = NEEDED.get(verb.name, [])
    with pytest.raises(InputError, match=option.name):
        function(*read, **{option.name: value})
    try:
        status = run([*command.split(), *map(str, read), *needed, option.command, *words])
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert option.command in capsys.readouterr().err


@pytest.mark.parametrize(
    ("kind", "good", "bad"),
    [
        (Number(above=0), (1, 0.5), (0, -1, True, "1", float("inf"), float("nan"), [1], 10**400)),
        (Number(low=0, high=2), (0, 2), (-0.1, 2.1)),
        (NumberPair(), ((0, 1), [2.0, 3.0]), ((1, 1), (3, 2), (1,), 5, (-1, 2), "ab", (1, 2, 3))),
        (OneOf(values=(1, -1)), (1, -1), (0, True, "1", [1])),
        (Whole(low=1, word="auto"), (1, 10**400, "auto"), (0, 1.0, 2.5, True, "other", "1")),
    ],
)
def test_what_a_kind_takes(kind, good, bad):
    assert all(map(kind.holds, good))
    assert not [value for value in bad if kind.holds(value)]


def test_a_word_stands_for_none_and_the_default_for_what_is_not_given():
    option = Option("cutoff_hz", Number(unit="Hz", above=0, nothing="none"), "{default}", 8.0)
    parser = argparse.ArgumentParser()
    option.add(parser)
    asked = [parser.parse_args(words) for words in ([], ["--cutoff-hz", "none"])]
    assert [option.value(one.cutoff_hz) for one in asked] == [8.0, None]
    with pytest.raises(InputError, match="--cutoff-hz 0.*none"):
        option.value("0")
    with pytest.raises(InputError, match="cutoff_hz 0.*None"):
        option.check(0)


def test_words_of_a_call_leave_out_defaults_and_folders():
    verb = Verb(
        "look",
        (
            Option("other", PlaceToRead(), "beside"),
            Option("n", Number(), "how many", 2.0),
            Option("by", AnyWord(), "columns", "condition", many=True),
            Option("fast", Switch(), "soon", False),
            Option("slow", Switch(to=False), "later", True, flag="--no-slow"),
            Option("length_m", Milli(unit="m"), "of it", 0.005, flag="--length-mm"),
            Option("angle_deg", Number(unit="deg"), "of it"),
            Option("late_s", Milli(unit="s"), "so much", flag="--late-ms"),
        ),
    )
    parser = argparse.ArgumentParser()
    verb.configure(parser)
    assert verb.words(parser.parse_args([])) == []
    columns = ["--by", "a", "--by", "b"]
    given = parser.parse_args(
        ["--other", "a/there", "--n", "3", *columns, "--fast", "--length-mm", "7"]
    )
    said = ["--other", "there", "--n", "3.0", *columns, "--fast", "--length-mm", "7.0"]
    assert verb.words(given) == said
    assert verb.keywords(given)["length_m"] == 0.007
    assert verb.keywords(parser.parse_args([]))["length_m"] == 0.005
    with pytest.raises(InputError, match="--other"):
        verb.refuse(given, Verb("stay", ()), "it elsewhere")
    verb.refuse(given, verb, "it elsewhere")
    # 0 is a number that was asked for, although it equals False
    nothing = parser.parse_args(["--angle-deg", "0", "--late-ms", "0"])
    assert verb.words(nothing) == ["--angle-deg", "0.0", "--late-ms", "0.0"]


def test_places_that_options_name_are_read():
    verb = Verb(
        "look", (Option("other", PlaceToRead(), "beside"), Option("n", Number(), "how many"))
    )
    parser = argparse.ArgumentParser()
    verb.configure(parser)
    assert verb.reads(parser.parse_args(["--other", "there"])) == [Path("there")]
    assert verb.reads(parser.parse_args([])) == [None]
    assert verb.differing({"other": None, "n": 3}) == ("Options of `look`: n 3",)
    assert verb.differing({}) == ()


def test_help_loads_no_numpy():
    # one process for all: what is loaded stays loaded, and the first command that loads is named
    code = (
        "import sys; from armimpedance.app.cli.main import make_parser\n"
        f"for name in {list(PLACES)!r}:\n"
        "    make_parser([name])\n"
        "    assert 'numpy' not in sys.modules, name\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
