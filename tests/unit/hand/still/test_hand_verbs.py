"""estimate, estimate_all and reflex: the same from a path and a record, and options that count."""

import numpy as np
import pandas as pd
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.hand.show import Estimates
from armimpedance.hand.still import side_by_side
from armimpedance.hand.still.estimation import in_order
from armimpedance.hand.still.show import estimate, estimate_all, reflex
from armimpedance.recordings.tables.folder import write_folder


@pytest.fixture(scope="module")
def recording(limb):
    made = limb.record(sets=3, force_noise=0.05, seed=4, subject=Subject("S4"))
    later = made.trials["set"] > 2
    condition = np.where(later, "<b>late</b>", "early")
    return made.with_step("two conditions", trials=made.trials.assign(condition=condition))


@pytest.fixture(scope="module")
def session(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("verbs") / "session"
    write_folder(recording, folder)
    return folder


def test_a_path_and_a_record_give_the_same_and_the_command_too(recording, session, tmp_path):
    of_record, of_path = estimate(recording), estimate(session)
    assert isinstance(of_record, Estimates)
    assert of_record.subject.id == "S4"
    pd.testing.assert_frame_equal(of_record.to_frame(), of_path.to_frame())
    assert main(["estimate", str(session), "--out", str(tmp_path / "a.csv")]) == 0
    of_path.to_csv(tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_groups_by_one_column_several_or_none(recording):
    assert estimate(recording, by=()).names == ("all trials",)
    one, two = estimate(recording, by="set"), estimate(recording, by=["condition", "set"])
    assert [e.keys["set"] for e in one] == [1, 2, 3]
    np.testing.assert_array_equal(two["early", 2].stiffness, one[(2,)].stiffness)


def test_all_methods_side_by_side(recording, monkeypatch):
    compared = estimate_all(recording, by=())
    assert list(compared.estimates["weighted"].stiffness.axes) == ["x", "y"]
    alone = estimate(recording, by=(), method="all")
    pd.testing.assert_frame_equal(alone.to_frame(), compared.estimates.to_frame())
    frame = compared.to_frame()
    assert set(frame["method"]) == {r.method for r in compared.groups[0].results}
    assert len(repr(compared).splitlines()) <= 12
    # that workers change nothing test_parallel.py tells; here they are asked for
    asked = []

    def alone(function, pieces, workers):
        asked.append(workers)
        return in_order(function, pieces, 1)

    monkeypatch.setattr(side_by_side, "in_order", alone)
    estimate_all(recording, by=(), workers=2)
    assert asked == [2]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"method": "magic"}, "one of weighted"),
        ({"by": "posture"}, "no column 'posture'"),
        ({"by": "K_11"}, "cannot be named"),
        ({"band_hz": (5, 45)}, "no effect"),
        ({"band_hz": (5, 45), "method": "all"}, "no effect"),
        ({"seed": -1}, "seed -1"),
    ],
)
def test_what_cannot_be_is_refused(recording, options, words):
    with pytest.raises(InputError, match=words):
        estimate(recording, **options)


def test_errors_name_the_path(session, tmp_path):
    with pytest.raises(InputError, match=r"session.*no column 'posture'"):
        estimate(session, by="posture")
    with pytest.raises(InputError, match="nowhere"):
        estimate(tmp_path / "nowhere")


def test_progress_is_told(recording):
    told = []
    estimate(recording, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 2), (2, 2)]


def test_verdicts_are_tables_and_short_texts(recording, session, tmp_path):
    verdicts = reflex(recording)
    assert verdicts.names == ("early", "<b>late</b>")
    assert verdicts["early"] is verdicts[0]
    assert len(verdicts[:1]) == 1
    with pytest.raises(InputError, match="'early'"):
        verdicts["never"]
    assert len(repr(verdicts).splitlines()) == 2
    assert "<b>" not in verdicts._repr_html_()
    verdicts.write(tmp_path / "b.csv")
    assert main(["reflex", str(session), "--out", str(tmp_path / "a.csv")]) == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    header = (tmp_path / "a.csv").read_text().splitlines()[0].split(",")
    assert list(verdicts.to_frame().columns) == header == list(verdicts.to_dict()[0])


def test_a_delay_is_given_in_milliseconds(recording):
    given = reflex(recording, delay_ms=55)
    assert given[0].delay_s == pytest.approx(0.055)
    assert not given[0].scanned


@pytest.mark.parametrize(
    "call",
    [
        ["--out", "x.txt"],
        ["--out", "x.csv", "--format", "json"],
        ["--format", "csv"],
        ["--seed", "1"],
        ["--band", "5", "45"],
        ["--method", "all", "--band", "5", "45"],
    ],
)
def test_the_command_refuses_options_that_have_no_effect(session, tmp_path, capsys, call):
    words = [str(tmp_path / word) if word.startswith("x.") else word for word in call]
    assert main(["estimate", str(session), *words]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
