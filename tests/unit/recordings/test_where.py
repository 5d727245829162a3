"""Which trials: an expression over the trial table says what plain numpy says, and runs nothing."""

from __future__ import annotations

import ast

import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals, MarkerRecording, MotionRecording
from armimpedance.limb.arm import elbow_skeleton
from armimpedance.recordings.where import parse_where, plain_name, with_where
from armimpedance.show.verbs.results import read

N = 24
COLUMNS = {
    "trial": np.arange(1, N + 1),
    "condition": np.array(["soft", "hard push", "Übung 3"])[np.arange(N) % 3],
    "protocol": np.arange(N) % 4 + 1,
    "set": np.repeat([1, 2], N // 2),
    "is_error": np.arange(N) % 5 == 0,
    "event_ON_s": np.where(np.arange(N) % 6 == 0, np.nan, 0.1 * np.arange(N)),
    "reach angle (deg)": 15.0 * np.arange(N),
    "note": np.where(np.arange(N) % 2, "late", ""),
}


@pytest.fixture
def trials():
    return pd.DataFrame(COLUMNS)


def left(trials, expression):
    return trials["trial"][parse_where(expression).choose(trials)[0]].tolist()


@pytest.mark.parametrize(
    ("expression", "meant"),
    [
        ("TP == 3", lambda c: c["protocol"] == 3),
        ("tp == 3 and is_error == 0", lambda c: (c["protocol"] == 3) & ~c["is_error"]),
        ("TP in (1, 4) or block == 2", lambda c: np.isin(c["protocol"], (1, 4)) | (c["set"] == 2)),
        ("TP not in [1, 4]", lambda c: ~np.isin(c["protocol"], (1, 4))),
        ("not is_error", lambda c: ~c["is_error"]),
        ("not (is_error or TP == 1)", lambda c: ~(c["is_error"] | (c["protocol"] == 1))),
        ("3 < trial <= 9", lambda c: (c["trial"] > 3) & (c["trial"] <= 9)),
        ("trial != 3", lambda c: c["trial"] != 3),
        ("condition == 'hard push'", lambda c: c["condition"] == "hard push"),
        ('condition in ("soft", "Übung 3")', lambda c: c["condition"] != "hard push"),
        ('"ush" in condition', lambda c: c["condition"] == "hard push"),
        ("event_ON_s > -1", lambda c: np.isfinite(c["event_ON_s"])),
        ("reach_angle_deg >= 180", lambda c: c["reach angle (deg)"] >= 180),
        ("note == 'late'", lambda c: c["note"] == "late"),
        ("note == ''", lambda c: c["note"] == ""),
        ("note < 'a'", lambda c: c["note"] == ""),
        ("event_ON_s != 0.5", lambda c: ~(np.nan_to_num(c["event_ON_s"]) == 0.5)),
        ("is_error == True", lambda c: c["is_error"]),
        ("protocol == set", lambda c: c["protocol"] == c["set"]),
        ("\n (TP == 3\n and trial < 9) ", lambda c: (c["protocol"] == 3) & (c["trial"] < 9)),
    ],
)
def test_an_expression_says_what_numpy_says(trials, expression, meant):
    expected = COLUMNS["trial"][meant(COLUMNS)].tolist()
    assert 0 < len(expected) < N
    assert left(trials, expression) == expected


def test_a_random_expression_says_what_numpy_says(trials):
    """Trees of comparisons, made at random, against Python's own evaluation of numpy arrays."""
    rng = np.random.default_rng(18)

    def made(depth):
        kind = rng.integers(4) if depth else 3
        if kind == 0:
            text, mask = made(depth - 1)
            return f"not ({text})", ~mask
        if kind < 3:
            (a, x), (b, y) = made(depth - 1), made(depth - 1)
            return (f"({a}) and ({b})", x & y) if kind == 1 else (f"({a}) or ({b})", x | y)
        name = str(rng.choice(["trial", "protocol", "set"]))
        sign, limit = str(rng.choice(["<", "<=", ">", ">=", "==", "!="])), int(rng.integers(1, 9))
        compare = {"<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal}
        compare |= {"==": np.equal, "!=": np.not_equal}
        return f"{name} {sign} {limit}", compare[sign](COLUMNS[name], limit)

    some = 0
    for _ in range(150):
        text, mask = made(4)
        if mask.any():
            some += 1
            assert left(trials, text) == COLUMNS["trial"][mask].tolist()
    assert some > 50


def test_equal_and_unequal_share_all_trials_also_where_a_value_is_missing(trials):
    for name, value in (("event_ON_s", "0.1"), ("note", "'late'")):
        both = left(trials, f"{name} == {value}") + left(trials, f"{name} != {value}")
        assert sorted(both) == COLUMNS["trial"].tolist()


def test_a_sentence_tells_expression_and_counts(trials):
    sentence = parse_where("TP==3 and not is_error").choose(trials)[1]
    chosen = (COLUMNS["protocol"] == 3) & ~COLUMNS["is_error"]
    assert "TP == 3 and (not is_error)" in sentence or "TP == 3 and not is_error" in sentence
    assert f"{chosen.sum()} of {N}" in sentence
    assert "TP == 3: 6" in sentence


def test_no_trial_left_tells_what_each_part_leaves(trials):
    with pytest.raises(InputError, match=r"TP == 3: 6; block == 9: 0"):
        parse_where("TP == 3 and block == 9").choose(trials)


def test_an_unknown_name_lists_those_that_there_are(trials):
    with pytest.raises(InputError) as caught:
        parse_where("velocity > 3").choose(trials)
    for name in ("TP", "block", "trial", "event_ON_s", "reach_angle_deg"):
        assert name in str(caught.value)
    with pytest.raises(InputError, match="one of reach_angle_deg, "):
        parse_where("reach_angel_deg > 3").choose(trials)


@pytest.mark.parametrize(
    "column", ["a b", "class", "3rd", "ﬁn", "xª", "(deg)", "Ünïcode", "load [N]"]
)
def test_every_column_has_a_name_that_can_be_written(column):
    name = plain_name(column)
    assert isinstance(ast.parse(name, mode="eval").body, ast.Name)
    trials = pd.DataFrame({"trial": [1, 2], column: [0.0, 5.0]})
    assert left(trials, f"{name} == 5") == [2]


@pytest.mark.parametrize(
    "expression",
    ["condition == 3", "trial == 'soft'", "trial in ('a', 'b')", "trial", "'a' in trial", "note"],
)
def test_what_cannot_be_compared_is_refused(trials, expression):
    with pytest.raises(InputError) as caught:
        parse_where(expression).choose(trials)
    assert "\n" not in str(caught.value)


HOSTILE = [
    "",
    " ",
    "(" * 100_000 + ")" * 100_000,
    "(" * 900 + "TP == 3" + ")" * 900,
    "not " * 400 + "is_error",
    "-" * 1900 + "1 == trial",
    "f(a=" * 400 + "1" + ")" * 400,
    "[" * 150 + "]" * 150,
    "lambda: " * 200 + "1",
    "9 ** 9 ** 9 ** 9 == trial",
    "trial == " + "9" * 1900,
    "trial == 1e999 ** 2",
    "'a' * 10 ** 9 == condition",
    "().__class__.__bases__[0].__subclasses__()",
    "__import__('os').system('true')",
    "trial.__class__ == 1",
    "trial[0] == 1",
    "TP = 3",
    "TP := 3",
    "(TP := 3) == 3",
    "TP == 3; import os",
    "TP == 3 & is_error == 0",
    "TP == 3\x00",
    "'\x00' == condition and",
    "TP == 1j",
    "condition == b'soft'",
    "condition == f'{trial}'",
    "trial in (1, (2, 3))",
    "trial in (*(1, 2), 3)",
    "trial == None",
    "trial is 3",
    "trial == ...",
    "[trial for trial in (1, 2)]",
    "trial if trial else trial",
    "await trial",
    "yield",
    "trial == '\\N{BELL",
    "\udcff == 3",
    "1 if",
    "TP == 3 #" + "x" * 3000,
    "trial < 3 <",
    "@trial",
    "`trial` == 3",
    "{1: 2} == trial",
    "trial @ trial",
    "tri\u202eal == 3",
]


@pytest.mark.parametrize("expression", HOSTILE)
def test_a_hostile_expression_is_one_line(trials, expression):
    with pytest.raises(InputError) as caught:
        parse_where(expression).choose(trials)
    said = str(caught.value)
    assert said.isprintable()
    assert len(said) < 400


@pytest.mark.filterwarnings("error")
def test_any_text_is_an_expression_or_a_typed_error(trials):
    rng = np.random.default_rng(5)
    words = [
        *"()[]{}=<>!+-*/%&|~^@:;,.'\"\\\n\t0_ \x00é",
        "1",
        "2.5",
        "1e400",
        "0x1",
        "TP",
        "trial",
    ]
    words += ["note", "and", "or", "not", "in", "is", "if", "else", "lambda", "==", "!=", "<="]
    words += ["for", "b''", "'soft'", "__x__"]
    said = []
    for _ in range(3000):
        text = "".join(rng.choice(words, rng.integers(1, 12)))
        if rng.random() < 0.5:
            text = " ".join(rng.choice(words, rng.integers(1, 9)))
        try:
            parse_where(text).choose(trials)
        except InputError as error:
            said.append(str(error))
    assert len(said) > 2000
    assert not [text for text in said if "\n" in text or "\x00" in text]


# ---- recordings ----------------------------------------------------------------------------------


def test_markers_are_chosen_with_their_emg():
    rng = np.random.default_rng(0)
    lengths, faster = np.array([5, 7, 6]), np.array([50, 70, 60])
    offsets, emg_offsets = (np.concatenate([[0], np.cumsum(n)]) for n in (lengths, faster))
    recording = MarkerRecording(
        sample_rate_hz=100.0,
        trials=pd.DataFrame({"trial": [1, 2, 3], "condition": ["a", "b", "a"]}),
        offsets=offsets,
        time_s=np.concatenate([np.arange(n) / 100 for n in lengths]),
        positions=rng.normal(size=(18, 2, 3)),
        names=("m", "n"),
        emg=EmgSignals(1000.0, emg_offsets, rng.normal(size=(180, 1)), ("biceps",)),
    )
    kept = with_where(recording, "condition == 'a'")
    assert kept.trials["trial"].tolist() == [1, 3]
    np.testing.assert_array_equal(kept.positions, np.delete(recording.positions, np.s_[5:12], 0))
    signals = np.delete(recording.emg.signals, np.s_[50:120], 0)
    np.testing.assert_array_equal(kept.emg.signals, signals)
    assert kept.emg.offsets.tolist() == [0, 50, 110]
    assert "2 of 3" in kept.provenance[-1]


def test_joint_motion_is_chosen_with_its_emg():
    rng = np.random.default_rng(1)
    skeleton = elbow_skeleton(70.0, 1.75)
    recording = MotionRecording(
        sample_rate_hz=100.0,
        trials=pd.DataFrame({"trial": [1, 2], "condition": ["a", "b"]}),
        offsets=np.array([0, 4, 10]),
        time_s=np.concatenate([np.arange(4), np.arange(6)]) / 100,
        coordinates=rng.normal(size=(10, len(skeleton.coordinates))),
        skeleton=skeleton,
        emg=EmgSignals(1000.0, np.array([0, 40, 100]), rng.normal(size=(100, 1)), ("biceps",)),
    )
    kept = with_where(recording, "trial == 2")
    np.testing.assert_array_equal(kept.coordinates, recording.coordinates[4:])
    np.testing.assert_array_equal(kept.emg.signals, recording.emg.signals[40:])


def test_a_folder_takes_it_and_so_do_the_commands(tables, tmp_path, capsys):
    folder = tables.write()
    kept = read(folder, where="direction_deg == 90")
    assert kept.trials["trial"].tolist() == [2]
    out = tmp_path / "kept"
    assert main(["convert", str(folder), str(out), "--where", "direction_deg == 90"]) == 0
    again = read(out)
    np.testing.assert_array_equal(again.position, read(folder).position[50:])
    assert any("1 of 2" in sentence for sentence in again.provenance)
    capsys.readouterr()
    assert main(["inspect", str(folder), "--where", "(" * 100_000]) == 2
    assert main(["inspect", str(folder), "--where", "TP == 3"]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 2
    assert "direction_deg" in told


def test_an_expression_that_cannot_be_read_is_told_before_the_recording_is(tables):
    tables.write()
    (tables.path / "samples.csv").write_text("nothing of use")
    with pytest.raises(InputError, match="cannot be read.*=="):
        read(tables.path, where="direction_deg = 90")


def test_an_exam_is_chosen_by_protocol_block_and_event(exams, tmp_path):
    trials = [
        exams.Trial("01_01_01.c3d", samples=100, trial_num=1, events=(("GO", 0.01),)),
        exams.Trial("01_02_01.c3d", samples=120, trial_num=2, events=(("GO", 0.05),)),
        exams.Trial("02_01_01.c3d", samples=140, trial_num=3, events=(), is_error=1),
    ]
    exam = exams.folder(tmp_path, exams.files(trials))

    def left(where, **options):
        return read(exam, force_by="limb", where=where, **options).trials["trial"].tolist()

    assert left("TP == 1") == [1, 3]
    assert left("block == 1 and event_GO_s > 0.02") == [2]
    assert left("not is_error") == [1, 2]
    assert left("trial >= 2", protocols=(1,)) == [3]
    with pytest.raises(InputError, match="file_index"):
        left("file_index == 0")
    with pytest.raises(InputError, match=r"no trial is left of 3 .TP == 2: 1; is_error: 1"):
        left("TP == 2 and is_error")


def test_both_events_in_one_option(exams, tmp_path, capsys):
    exam = exams.folder(tmp_path / "exam", exams.files())
    call = ["convert", str(exam), str(tmp_path / "out"), "--force-by", "limb"]
    assert main([*call, "--events", "PERT_ON", "PERT_OFF"]) == 0
    short = read(tmp_path / "out")
    assert main([*call, "--replace", "--onset-event", "PERT_ON", "--end-event", "PERT_OFF"]) == 0
    assert short.trials.equals(read(tmp_path / "out").trials)
    assert main([*call, "--replace", "--events", "PERT_ON", "PERT_OFF", "--end-event", "GO"]) == 2
    assert "--events with" in capsys.readouterr().err
