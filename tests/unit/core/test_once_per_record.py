"""A record is asked once, and forgotten with its answer when nobody holds it any more."""

import gc
from dataclasses import dataclass

import pytest

from armimpedance.core.arrays import once_per_record


@dataclass(frozen=True, eq=False)
class Asked:
    number: int


def test_a_record_is_asked_once_and_another_one_anew():
    calls = []

    @once_per_record
    def doubled(record):
        calls.append(record.number)
        return 2 * record.number

    one, other = Asked(1), Asked(2)
    assert [doubled(one), doubled(one), doubled(other), doubled(one)] == [2, 2, 4, 2]
    assert calls == [1, 2]


def test_answers_go_with_their_records_and_never_to_others():
    @once_per_record
    def number_of(record):
        return record.number

    # addresses of records that are gone are given to new ones
    for number in range(300):
        record = Asked(number)
        assert number_of(record) == number
        del record
        gc.collect(0)


def test_what_fails_is_asked_again():
    answers = iter([ValueError("no"), 3])

    @once_per_record
    def asked(_record):
        answer = next(answers)
        if isinstance(answer, Exception):
            raise answer
        return answer

    record = Asked(1)
    with pytest.raises(ValueError, match="no"):
        asked(record)
    assert asked(record) == 3
