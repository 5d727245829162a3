"""The laws of scoring: what is right, wrong, missing, infinite, unsaid or silent is told so."""

from __future__ import annotations

import math
import random

import pytest

from armimpedance.lab.benchmark import AskedGroup, AskedQuantity, KnownTruth, record_names
from armimpedance.lab.benchmark.scoring import Claim, score

RECORDS = [*record_names("public", 4), *record_names("sealed", 3)]
MATRIX = [[100.0, -30.0], [-20.0, 200.0]]


@pytest.fixture
def truth() -> list[KnownTruth]:
    groups = [AskedGroup.matrix("K", "N/m", MATRIX), AskedGroup("I", "kg m^2", {"I": 0.07})]
    return [k for record in RECORDS for group in groups for k in group.known("task", record)]


def place(known: KnownTruth) -> tuple[str, str, str]:
    return known.asked.task, known.asked.record, known.asked.quantity


def said(truth, error=0.0, width=0.02, **more):
    """Claims that are all off by `error`, in parts of the scale."""
    return {
        place(k): Claim(
            k.value + error * k.scale,
            k.value + (error - width / 2) * k.scale,
            k.value + (error + width / 2) * k.scale,
            **more,
        )
        for k in truth
    }


def test_the_truth_itself_has_no_error_and_every_interval_holds(truth):
    for row in score(truth, said(truth)):
        assert row.bias == row.random == row.total == 0
        assert row.coverage == 1
        assert row.silently_wrong == 0
        assert row.answered == row.asked
        assert row.width == pytest.approx(0.02)
        assert row.interval_score == pytest.approx(0.02)
    assert [(r.half, r.group, r.asked) for r in score(truth, said(truth))] == [
        ("public", "K", 16),
        ("public", "I", 4),
        ("sealed", "K", 12),
        ("sealed", "I", 3),
    ]


def test_a_shift_is_bias_a_scatter_is_random_and_their_squares_add(truth):
    for row in score(truth, said(truth, 0.3)):
        assert (row.bias, row.total) == pytest.approx((0.3, 0.3))
        assert row.random == pytest.approx(0, abs=1e-12)
        assert row.coverage == 0
        assert row.silently_wrong == 1
        # u - l + 2 / alpha times how far outside the truth lies
        assert row.interval_score == pytest.approx(0.02 + 40 * 0.29)
    signs = {name: (-1) ** n for n, name in enumerate(RECORDS)}
    scattered = {
        place(k): Claim(k.value + (0.1 + 0.2 * signs[k.asked.record]) * k.scale) for k in truth
    }
    for row in score(truth, scattered):
        assert row.total**2 == pytest.approx(row.bias**2 + row.random**2)
    even = score(truth, scattered)[0]
    assert (even.bias, even.random) == pytest.approx((0.1, 0.2))


def test_an_error_of_a_matrix_is_that_of_its_frobenius_norm():
    (first, *rest) = AskedGroup.matrix("K", "N/m", MATRIX).known("task", "p01")
    wrong = {place(first): Claim(110.0)} | {place(k): Claim(k.value) for k in rest}
    (row,) = score([first, *rest], wrong)
    size = math.sqrt(100**2 + 30**2 + 20**2 + 200**2)
    assert row.total == pytest.approx(10 / size)


def test_a_warning_or_an_interval_that_holds_breaks_the_silence(truth):
    assert all(r.silently_wrong == 0 for r in score(truth, said(truth, 0.3, warned=True)))
    assert all(r.silently_wrong == 0 for r in score(truth, said(truth, 0.3, width=0.7)))
    assert all(r.silently_wrong == 0 for r in score(truth, said(truth, 0.09)))


def test_what_is_missing_or_no_number_counts_as_unsaid(truth):
    full = said(truth)
    absent = dict(list(full.items())[5:])
    for n, gone in enumerate(list(full)[:5]):
        broken = absent | {gone: Claim((math.nan, math.inf, -math.inf)[n % 3], 0.0, 1.0)}
        assert score(truth, broken) == score(truth, absent)
    first = score(truth, absent)[0]
    assert (first.asked, first.answered, first.intervals) == (16, 12, 12)
    assert first.interval_score == pytest.approx((12 * 0.02 + 4 * 2.0) / 16)
    assert score(truth, {}) == []
    nothing = {place(k): Claim(math.nan) for k in truth}
    assert all(r.total is None and r.interval_score == 2.0 for r in score(truth, nothing))


def test_no_width_wins(truth):
    honest = score(truth, said(truth, 0.01, width=0.05))
    infinite = {p: Claim(c.value, -math.inf, math.inf) for p, c in said(truth).items()}
    wide, bare = score(truth, said(truth, width=1e6)), score(truth, infinite)
    none = score(truth, {p: Claim(c.value) for p, c in said(truth, 0.02).items()})
    for good, absurd, endless, naked in zip(honest, wide, bare, none, strict=True):
        assert absurd.coverage == endless.coverage == 1
        assert good.interval_score < 2.0 < absurd.interval_score < endless.interval_score
        assert math.isinf(endless.width)
        # a value without an interval is one of no width
        assert naked.coverage is None
        assert naked.interval_score == pytest.approx(40 * 0.02)


def test_an_interval_of_zero_width_is_one_and_holds_nothing_but_the_truth_itself(truth):
    for row in score(truth, said(truth, 0.02, width=0.0)):
        assert (row.coverage, row.width) == (0, 0)
        assert row.interval_score == pytest.approx(40 * 0.02)
    assert all(r.silently_wrong == 1 for r in score(truth, said(truth, 0.3, width=0.0)))


def test_half_open_intervals_are_endless_and_never_beat_an_honest_one(truth):
    for low, high in ((-math.inf, 0.0), (0.0, math.inf)):
        claims = {place(k): Claim(k.value, k.value + low, k.value + high) for k in truth}
        assert all(math.isinf(r.interval_score) for r in score(truth, claims))


def test_an_interval_elsewhere_than_its_value_is_scored_by_where_it_lies(truth):
    # a right value does not lend its interval anything, nor the interval the value
    apart = {
        place(k): Claim(k.value, k.value + 0.5 * k.scale, k.value + 0.6 * k.scale) for k in truth
    }
    for row in score(truth, apart):
        assert (row.total, row.coverage) == (0, 0)
        assert row.interval_score == pytest.approx(0.1 + 40 * 0.5)


def test_who_warns_of_everything_is_seen_to_and_who_leaves_out_what_is_hard_gains_nothing(truth):
    always = score(truth, said(truth, 0.3, warned=True))
    assert all((r.silently_wrong, r.warned) == (0, 1) for r in always)
    # one wrong record of each half left out: its rows are still asked
    bad = {"p01", "s01"}
    mixed = said(truth) | {p: c for p, c in said(truth, 0.3, width=0.02).items() if p[1] in bad}
    for whole, part in zip(
        score(truth, mixed),
        score(truth, {p: c for p, c in mixed.items() if p[1] not in bad}),
        strict=True,
    ):
        assert part.answered < part.asked == whole.asked
        # worse than right, better than 30 % off at 2 % width
        assert 0.02 < part.interval_score < whole.interval_score


def test_the_order_of_rows_changes_no_bit(truth):
    rng = random.Random(5)  # noqa: S311
    claims = {p: Claim(c.value * rng.lognormvariate(0, 1)) for p, c in said(truth).items()}
    first = score(truth, claims)
    for _ in range(5):
        items, rows = list(claims.items()), list(truth)
        rng.shuffle(items)
        rng.shuffle(rows)
        key = [(r.half, r.group) for r in first]
        again = {(r.half, r.group): r for r in score(rows, dict(items))}
        assert [again[k] for k in key] == first


def test_the_time_is_the_median_over_records():
    asked = [AskedQuantity("task", r, "I", "I", "kg") for r in ("p01", "p02", "p03")]
    truth = [KnownTruth(a, 1.0, 1.0) for a in asked]
    claims = {place(k): Claim(1.0, time_s=t) for k, t in zip(truth, (1, 9, 2), strict=True)}
    assert score(truth, claims)[0].time_s == 2
