"""The study of broken assumptions, in small: what it counts, and that it runs from end to end."""

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.append(str(ROOT / "benchmarks"))

import broken_assumptions as study  # noqa: E402
from broken import cell as cells  # noqa: E402
from broken.advice import ADVICE  # noqa: E402
from broken.hand_plant import Hand, bump  # noqa: E402
from broken.joint_plant import Bent, Joint, bent, linear, naive_joint  # noqa: E402

from armimpedance.core.errors import InputError  # noqa: E402
from armimpedance.core.findings import Finding  # noqa: E402

COMMANDS = {
    "elbow", "elbow --time-varying", "elbow --emg-law", "estimate", "reflex", "inspect", "map",
    "compare", "passive", "body", "therapy robot", "therapy arm", "therapy contribution",
    "fit activation", "fit moment-arms", "convert", "random", "movement",
}  # fmt: skip


def test_sixty_violations_over_all_commands_each_with_advice_and_clean_records():
    every = study.all_cells().values()
    broken = [c for c in every if c.violation]
    assert len(broken) >= 60
    assert {c.rig.command for c in broken} == COMMANDS
    clean = {(c.rig.command, c.rig.name) for c in every if not c.violation}
    assert {(c.rig.command, c.rig.name) for c in broken} <= clean
    assert {c.violation for c in broken} <= set(ADVICE)
    assert all(c.named_by for c in broken)


def counted(answer, truth, names=("reflex",), violation="reflex"):
    """The tally of one record with this answer."""

    def run(_made):
        if isinstance(answer, Exception):
            raise answer
        return answer

    rig = cells.Rig("elbow", "none", lambda _: [cells.Made(None, truth)], run)
    return cells.run_cell(cells.Cell(rig, violation, "", names, rig.make), 1)


def test_a_typed_error_is_a_refusal_and_another_error_is_none():
    tally = counted(InputError("no", expected="yes"), {"K": 1.0})
    assert (tally.refused, tally.silently_wrong) == (1, 0)
    assert tally.example == "no (expected yes)"
    with pytest.raises(ZeroDivisionError):
        counted(ZeroDivisionError(), {"K": 1.0})


@pytest.mark.parametrize(("truth", "wrong"), [(12.9, 0.0), (13.1, 1.0), (7.1, 0.0), (6.9, 1.0)])
def test_an_interval_is_wrong_where_it_misses_though_widened_by_half(truth, wrong):
    tally = counted(cells.Answer({"K": (10.0, 8.0, 12.0)}), {"K": truth})
    assert tally.silently_wrong == wrong
    assert tally.wide_or_right == 1 - wrong


def test_each_printed_number_counts_as_its_part():
    answer = cells.Answer({"B": (1.0, 0.9, 1.1), "K": (10.0, 8.0, 12.0)})
    tally = counted(answer, {"B": 1.0, "K": 20.0})
    assert tally.silently_wrong == 0.5
    assert tally.records_wrong == 1.0
    assert tally.wrong == {"K": 1}


@pytest.mark.parametrize(
    ("found", "sentences", "named"),
    [
        (Finding("reflex", "warning", "25 %"), (), 1.0),
        (Finding("skew", "warning", "2 ms"), (), 0.0),
        (Finding("reflex", "cannot tell", "up to 20 %"), (), 0.0),
        (Finding("reflex", "ok", "none"), (), 0.0),
        (Finding("", "ok", ""), ("a reflex of 25 % stands in K",), 1.0),
        (Finding("", "ok", ""), ("the residuals are not white: a reflex, a tremor",), 0.0),
    ],
)
def test_only_a_warning_with_the_name_names(found, sentences, named):
    told = cells.said([found], (found.sentence, *sentences))
    tally = counted(cells.Answer({"K": (10.0, 9.0, 11.0)}, **told), {"K": 20.0})
    assert tally.named == named
    assert tally.silently_wrong == 1 - named


def test_silence_is_wrong_where_a_command_prints_no_number():
    assert counted(cells.Answer({}), {}).silently_wrong == 1.0
    assert counted(cells.Answer({}), {}, (), "").silently_wrong == 0.0


def test_effect_is_in_standard_errors_of_the_clean_interval():
    clean = {"half": {"K": 1.96, "B": 0.196}, "naive": {"K": 0.5}}
    assert cells.effect({"error": {"K": 3.0, "B": 0.1}, "naive": {}}, clean) == pytest.approx(3.0)
    hidden = {"error": {"K": 0.1}, "naive": {"K": 8.5}}
    assert cells.effect(hidden, clean) == pytest.approx(8.0)
    assert cells.effect({"error": {}, "naive": {}}, clean) == float("inf")


@pytest.mark.parametrize("device", [None, (0.2, 1.0, 3.0), (0.0, 0.0, float("inf"))])
def test_the_linear_joint_obeys_its_law_whatever_moves_it(device):
    joint = Joint(device=device, snr_db=300.0, duration_s=8.0)
    found = naive_joint(joint.record(0))
    # what the taper leaks over eight seconds is all that is left
    for name, truth in joint.truth.items():
        assert found[name] == pytest.approx(truth, rel=0.02)


def test_the_integrated_joint_is_the_linear_one_where_nothing_bends_it():
    joint = Joint(snr_db=300.0, duration_s=6.0)
    (made,) = bent(joint, Bent())([0])
    for name, truth in joint.truth.items():
        assert naive_joint(made)[name] == pytest.approx(truth, rel=0.02)


def test_a_record_is_the_same_whoever_asks():
    one = linear(Joint(duration_s=3.0))([5])[0].record
    other = linear(Joint(duration_s=3.0))([4, 5])[1].record
    np.testing.assert_array_equal(one.position, other.position)
    assert not np.array_equal(linear(Joint(duration_s=3.0))([4])[0].record.force, one.force)


def test_the_bump_has_the_derivatives_that_it_says():
    t = np.arange(0, 0.3, 1e-4)
    x, v, a = bump(t, 0.3)
    # differences at .1 ms; the acceleration has a corner where the way turns
    np.testing.assert_allclose(np.gradient(x, t)[2:-2], v[2:-2], atol=2e-4)
    np.testing.assert_allclose(np.gradient(v, t)[2:-2], a[2:-2], atol=1.0)
    assert Hand().record(0).record.n_trials == 16


def test_a_small_study_from_records_to_page(tmp_path):
    every = study.all_cells()
    violations = ("", "torque's sign", "torque in mNm", "hum in the torque")
    keys = [
        k for k, c in every.items()
        if (c.rig.command, c.rig.name) == ("elbow", "bench") and c.violation in violations
    ]  # fmt: skip
    study.run(keys, 2, tmp_path, 1, again=False)
    files = sorted(tmp_path.glob("*.json"))
    times = [f.stat().st_mtime_ns for f in files]
    study.run(keys, 2, tmp_path, 1, again=False)
    assert [f.stat().st_mtime_ns for f in files] == times
    rows = study.table(keys, 2, tmp_path).set_index("violation")
    shares = rows[["silently_wrong", "named", "refused", "wide_or_right"]].sum(axis=1)
    np.testing.assert_allclose(shares, 1, atol=1e-3)
    assert rows.loc["none", "silently_wrong"] == 0
    assert np.isnan(rows.loc["none", "effect_in_se"])
    assert rows.loc["torque's sign", "silently_wrong"] == 0
    assert rows.loc["hum in the torque", "wide_or_right"] == 1
    assert rows.loc["torque in mNm", "effect_in_se"] > study.EFFECT_SE
    from broken.page import write_page

    (tmp_path / "gallery").mkdir()
    write_page(rows.reset_index(), tmp_path)
    pages = {
        p.stem: p.read_text() for p in (tmp_path / "evidence" / "what_can_go_wrong").glob("*.md")
    }
    assert "| torque's sign, turned |" in pages["joint_sensors"]
    assert "(joint_sensors.md)" in pages["index"]
    assert (tmp_path / "gallery" / "what_can_go_wrong_joint.png").stat().st_size > 1000
