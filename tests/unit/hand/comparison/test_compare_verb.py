"""compare: from recordings, results, paths and mappings, and what it refuses."""

import numpy as np
import pandas as pd
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.hand.comparison.show import compare, plot_comparison
from armimpedance.hand.still.show import estimate
from armimpedance.recordings.tables.folder import write_folder


def two_conditions(limb, seed):
    """Two sets relaxed, two sets stiffer by a third."""
    first, second = (
        limb.record(sets=4, force_noise=0.05, seed=seed, stiffness=k)
        for k in (limb.K, 1.3 * limb.K)
    )
    later = first.trials["set"].to_numpy() > 2
    samples = np.repeat(later, np.diff(first.offsets))[:, None]
    return first.with_step(
        "made of two limbs",
        force=np.where(samples, second.force, first.force),
        trials=first.trials.assign(condition=np.where(later, "<i>tense", "relaxed")),
        shoulder_m=np.zeros(2),
        subject=Subject(f"S{seed}"),
    )


@pytest.fixture(scope="module")
def people(limb):
    return {name: two_conditions(limb, seed) for seed, name in enumerate(("ann", "ben"))}


def test_path_record_and_command_give_the_same(people, tmp_path):
    write_folder(people["ann"], tmp_path / "ann")
    of_record = compare(people["ann"], permutations=49)
    of_path = compare(tmp_path / "ann", permutations=49)
    pd.testing.assert_frame_equal(of_record.to_frame(), of_path.to_frame())
    call = ["compare", str(tmp_path / "ann"), "--permutations", "49", "--out"]
    assert main([*call, str(tmp_path / "a.csv")]) == 0
    of_path.write(tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    header = (tmp_path / "a.csv").read_text().splitlines()[0].split(",")
    assert list(of_record.to_frame().columns) == header == list(of_record.to_dict()[0])


def test_short_texts_are_short_and_escaped(people):
    found = compare(people["ann"], permutations=49)
    assert len(repr(found).splitlines()) <= 12
    assert "<i>" not in found._repr_html_()
    assert "Stiffness K" in str(found)
    assert plot_comparison(found.groups, found.pairs).get_xlabel() == "x (m)"


def test_results_stand_for_recordings(people, tmp_path):
    results = estimate(people["ann"])
    results.write(tmp_path / "r.csv")
    found = compare(results, permutations=49)
    assert found.pairs[0].basis == "covariance"
    of_file = compare([tmp_path / "r.csv"], permutations=49)
    pd.testing.assert_frame_equal(found.to_frame(), of_file.to_frame())


def test_names_of_a_mapping_are_those_of_the_recordings(people):
    found = compare(people, by="recording", permutations=49)
    assert (found.pairs[0].first, found.pairs[0].second) == ("ann", "ben")
    over = compare(people, subjects="recording")
    assert over.pairs == ()
    assert {change.n for change in over.over_subjects} == {2}
    assert "size of K" in repr(over)
    by_id = compare(list(people.values()), subjects="subject")
    pd.testing.assert_frame_equal(over.to_frame(), by_id.to_frame())


def test_progress_counts_groups_then_pairs(people):
    told = []
    options = {"permutations": 49, "progress": lambda done, total: told.append((done, total))}
    compare(people["ann"], **options)
    assert told == [(1, 2), (2, 2), (1, 1)]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"permutations": 0}, "permutations 0"),
        ({"permutations": 9, "subjects": "recording"}, "no effect"),
        ({"method": "magic"}, "one of weighted"),
        ({"seed": -1}, "seed -1"),
        ({"against": "nobody"}, "no group 'nobody'"),
    ],
)
def test_what_cannot_be_is_refused(people, options, words):
    with pytest.raises(InputError, match=words):
        compare(people["ann"], **options)


def test_inputs_that_do_not_go_together_are_refused(people):
    results = estimate(people["ann"])
    with pytest.raises(InputError, match="in one call"):
        compare([results, people["ben"]])
    with pytest.raises(InputError, match="no effect on results"):
        compare(results, method="exact")
    with pytest.raises(InputError, match="several recordings"):
        compare(people)
    with pytest.raises(InputError, match="nothing to compare"):
        compare([])


@pytest.mark.parametrize("call", [["--which", "inertia"], ["--seed", "1", "--subjects", "set"]])
def test_the_command_refuses_options_that_have_no_effect(people, tmp_path, capsys, call):
    write_folder(people["ann"], tmp_path / "ann")
    assert main(["compare", str(tmp_path / "ann"), *call]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
