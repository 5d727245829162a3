"""Make, score, table: to the bit, and a sealed truth that can be shown to have been fixed."""

from __future__ import annotations

import csv
import json
import subprocess
import sys

import pytest

from armimpedance.__main__ import main
from armimpedance.lab.benchmark import BenchmarkFolder
from armimpedance.lab.benchmark.folder import asked_text, read_known

KEY = "7" * 64


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A benchmark of one task with a sealed half, and its key."""
    folder = tmp_path_factory.mktemp("benchmark")
    (folder / "secret.key").write_text(KEY)
    call = ["benchmark", "make", "--quick", "--task", "joint_position"]
    assert main([*call, "--key", str(folder / "secret.key"), "--out", str(folder / "b")]) == 0
    return folder


def submission(file, folder, factor=1.0, records="ps"):
    """Rows that are right by a factor wherever the truth is public, 1 elsewhere."""
    benchmark = BenchmarkFolder.open(folder)
    truth = {k.asked: k.value for k in benchmark.public_truth()}
    with file.open("w", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(["task", "record", "quantity", "value"])
        for a in benchmark.asked:
            if a.record[0] in records:
                rows.writerow([a.task, a.record, a.quantity, repr(factor * truth.get(a, 1.0))])
    return file


def test_the_same_key_gives_the_same_folder_whatever_the_threads(made, tmp_path):
    code = "import sys; from armimpedance.__main__ import main; sys.exit(main(sys.argv[1:]))"
    call = [
        "benchmark", "make", "--quick", "--task", "joint_position",
        "--key", str(made / "secret.key"), "--out", str(tmp_path / "b"),
    ]  # fmt: skip
    environment = {"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONHASHSEED": "3"}
    subprocess.run([sys.executable, "-c", code, *call], check=True, env=environment)
    assert (tmp_path / "b/SHA256SUMS").read_bytes() == (made / "b/SHA256SUMS").read_bytes()


def test_no_sealed_truth_and_no_seed_lies_in_the_folder(made):
    files = [p for p in (made / "b").rglob("*") if p.is_file()]
    assert not [p for p in files if p.name == "truth.csv" and "sealed" in p.parts]
    assert all(KEY not in p.read_text() for p in files if p.suffix != ".parquet")
    for p in (made / "b").rglob("recording.json"):
        told = json.loads(p.read_text())
        assert "seed" not in json.dumps(told["provenance"])
        assert "mass_kg" not in told["subject"]


def test_public_half_without_the_key_both_with_it(made, tmp_path, capsys):
    mine = submission(tmp_path / "mine.csv", made / "b")
    call = ["benchmark", "score", str(made / "b"), str(mine), "--out"]
    assert main([*call, str(tmp_path / "open.json")]) == 0
    told = json.loads((tmp_path / "open.json").read_text())
    assert {s["half"] for s in told["scores"]} == {"public"}
    assert all(s["total"] == 0 for s in told["scores"])
    key = ["--key", str(made / "secret.key")]
    assert main([*call, str(tmp_path / "all.json"), *key]) == 0
    sealed = list(json.loads((tmp_path / "all.json").read_text())["scores"])
    # whoever copies the public truths is found out by the sealed ones
    assert all(s["total"] > 0.1 for s in sealed if s["half"] == "sealed")
    assert main([*call, str(tmp_path / "again.json"), *key, "--name", "mine"]) == 0
    assert (tmp_path / "again.json").read_bytes().replace(b"again", b"all") == (
        tmp_path / "all.json"
    ).read_bytes()


def test_a_table_of_two_has_the_better_first_and_infinite_widths_in_it(made, tmp_path):
    good = submission(tmp_path / "good.csv", made / "b", 1.01, "p")
    bad = submission(tmp_path / "bad.csv", made / "b", 1.5, "p")
    text = bad.read_text().replace("value", "value,low,high", 1).splitlines()
    bad.write_text("\n".join([text[0], *(f"{line},-inf,inf" for line in text[1:])]))
    for file in (good, bad):
        out = str(file.with_suffix(".json"))
        assert main(["benchmark", "score", str(made / "b"), str(file), "--out", out]) == 0
    table = tmp_path / "table.md"
    scores = [str(f.with_suffix(".json")) for f in (bad, good)]
    assert main(["benchmark", "table", *scores, "--out", str(table)]) == 0
    lines = table.read_text().splitlines()
    (first,) = [n for n, line in enumerate(lines) if line.startswith("| good")]
    assert lines[first + 1].startswith("| bad")
    assert "∞" in lines[first + 1]


def test_another_key_or_a_changed_truth_is_refused(made, tmp_path, capsys):
    import shutil

    mine = submission(tmp_path / "mine.csv", made / "b")
    other = tmp_path / "other.key"
    other.write_text("8" * 64)
    out = ["--out", str(tmp_path / "mine.json")]
    assert main(["benchmark", "score", str(made / "b"), str(mine), *out, "--key", str(other)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    shutil.copytree(made / "b", tmp_path / "b")
    truth = tmp_path / "b/tasks/joint_position/public/p01/truth.csv"
    known = read_known(truth)
    truth.write_text(truth.read_text().replace(repr(known[0].value), "1.0"))
    assert main(["benchmark", "score", str(tmp_path / "b"), str(mine), *out]) == 2
    assert "truth.csv" in capsys.readouterr().err
    assert not (tmp_path / "mine.json").exists()


def test_a_key_never_lies_in_what_is_published_and_is_read_by_its_owner_alone(tmp_path, capsys):
    call = [
        "benchmark",
        "make",
        "--quick",
        "--task",
        "joint_position",
        "--out",
        str(tmp_path / "b"),
    ]
    assert main([*call, "--key", str(tmp_path / "b" / "k")]) == 2
    (tmp_path / "short").write_text("ab\n")
    assert main([*call, "--key", str(tmp_path / "short")]) == 2
    assert main([*call, "--key", str(tmp_path / "new")]) == 0
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o600


def test_what_is_asked_is_written_as_it_is_read(made):
    benchmark = BenchmarkFolder.open(made / "b")
    file = made / "b/tasks/joint_position/asked.csv"
    assert asked_text(benchmark.asked) == file.read_text()
