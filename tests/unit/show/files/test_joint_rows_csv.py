"""Joint-level rows from a script's own table: what is needed, what is optional, what is refused."""

import csv

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.levels.symmetry import symmetric_part
from armimpedance.hand.show.results_csv import write_results
from armimpedance.muscles.show.rows_csv import read_joint_rows

NEEDED = ["level", "q_shoulder_rad", "q_elbow_rad"]
ELEMENTS = [f"{symbol}_{i}{j}" for symbol in "KB" for i in "12" for j in "12"]


def a_row(**changes):
    numbers = dict(zip(ELEMENTS, (15.0, 6.0, 5.5, 16.0, 1.2, 0.4, 0.5, 1.3), strict=True))
    return {"level": "joint", "q_shoulder_rad": 1.04, "q_elbow_rad": 1.57, **numbers, **changes}


def write(path, rows):
    names = list(dict.fromkeys(name for row in rows for name in row))
    with open(path, "w", newline="") as stream:
        table = csv.DictWriter(stream, names)
        table.writeheader()
        table.writerows(rows)
    return path


def test_a_table_with_the_least_columns_is_enough(tmp_path):
    rows = read_joint_rows([write(tmp_path / "k.csv", [a_row(), a_row(q_elbow_rad=1.2)])])
    assert rows.n_rows == 2
    assert rows.joint_angles[1].tolist() == [1.04, 1.2]
    assert rows.stiffness[0].tolist() == [[15.0, 6.0], [5.5, 16.0]]
    assert rows.viscosity[0].tolist() == [[1.2, 0.4], [0.5, 1.3]]
    optional = (rows.stiffness_sd, rows.viscosity_sd, rows.activation, rows.torque)
    assert optional == (None,) * 4
    assert rows.labels[1] == "k.csv row 3"


def test_weights_activations_and_torques_are_taken(tmp_path):
    sd = {f"sd_{name}": 0.5 + i for i, name in enumerate(ELEMENTS)}
    alpha = {f"alpha_{i}": i / 10 for i in range(1, 7)} | {
        f"sd_alpha_{i}": 0.01 for i in range(1, 7)
    }
    given = a_row(**sd, **alpha, torque_1_Nm=-2.0, torque_2_Nm=3.0, condition="a")
    rows = read_joint_rows([write(tmp_path / "k.csv", [given]), write(tmp_path / "l.csv", [given])])
    assert rows.stiffness_sd[0].ravel().tolist() == [0.5, 1.5, 2.5, 3.5]
    assert rows.viscosity_sd[0].ravel().tolist() == [4.5, 5.5, 6.5, 7.5]
    assert rows.activation[1] == pytest.approx(np.arange(1, 7) / 10)
    assert rows.activation_sd[1].tolist() == [0.01] * 6
    assert rows.torque[1].tolist() == [-2.0, 3.0]
    assert rows.labels == ("k.csv row 2 (a)", "l.csv row 2 (a)")


def test_muscles_are_named_alike_in_all_rows_or_not_at_all(tmp_path):
    alpha = {"alpha_1": 0.1, "alpha_2": 0.2, "muscles": "x; y"}
    rows = read_joint_rows([write(tmp_path / "k.csv", [a_row(**alpha), a_row(**alpha)])])
    assert rows.muscles == ("x", "y")
    mixed = write(tmp_path / "k.csv", [a_row(**alpha), a_row(**{**alpha, "muscles": "y; x"})])
    with pytest.raises(InputError, match="row 3, column muscles: y; x, while other rows have x; y"):
        read_joint_rows([mixed])
    silent = write(tmp_path / "k.csv", [a_row(**{**alpha, "muscles": ""}), a_row(**alpha)])
    with pytest.raises(InputError, match="row 2, column muscles: no names, while"):
        read_joint_rows([silent])


def test_our_own_results_are_read(tmp_path, make_estimate):
    made = symmetric_part(make_estimate(level="joint"))
    write_results([made], tmp_path / "RESULTS.csv")
    rows = read_joint_rows([tmp_path / "RESULTS.csv"])
    assert np.array_equal(rows.stiffness[0], made.stiffness)
    assert np.array_equal(rows.stiffness_sd[0], made.sd[2])
    assert np.array_equal(rows.viscosity_sd[0], made.sd[1])


@pytest.mark.parametrize(
    ("changes", "place", "expected"),
    [
        ({"level": "hand"}, "row 3, column level", "map --to joint"),
        ({"K_12": "abc"}, "row 3, column K_12: not a number", "a finite number"),
        ({"B_22": "nan"}, "row 3, column B_22", "a finite number"),
        ({"q_elbow_rad": ""}, "row 3, column q_elbow_rad: empty", "a finite number"),
        ({"sd_K_21": 0.0}, "row 3, column sd_K_21: 0", "above 0"),
        ({"alpha_2": 1.3}, "row 3, column alpha_2: 1.3", "0 to 1"),
        ({"alpha_6": -0.01}, "row 3, column alpha_6", "0 to 1"),
        ({"K_33": 4.0}, "row 3, column K_33: 3 joints", "four angles"),
    ],
)
def test_a_bad_cell_is_named(tmp_path, changes, place, expected):
    extra = {f"sd_{name}": 0.5 for name in ELEMENTS} | {f"alpha_{i}": 0.1 for i in range(1, 7)}
    path = write(tmp_path / "k.csv", [a_row(**extra), a_row(**(extra | changes))])
    with pytest.raises(InputError) as refused:
        read_joint_rows([path])
    assert place in str(refused.value)
    assert expected in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("column", [*NEEDED, *ELEMENTS])
def test_a_missing_column_is_named(tmp_path, column):
    row = {name: value for name, value in a_row().items() if name != column}
    with pytest.raises(InputError, match=f"column {column}: no such column"):
        read_joint_rows([write(tmp_path / "k.csv", [row])])


@pytest.mark.parametrize("column", ["sd_K_11", "alpha_1", "torque_1_Nm"])
def test_some_rows_with_and_some_without_is_refused(tmp_path, column):
    full = {f"sd_{name}": 0.5 for name in ELEMENTS} | {f"alpha_{i}": 0.1 for i in range(1, 7)}
    full |= {"torque_1_Nm": 1.0, "torque_2_Nm": 1.0}
    path = write(tmp_path / "k.csv", [a_row(**full), a_row(**(full | {column: ""}))])
    with pytest.raises(
        InputError, match=f"row 3, column {column}: empty, while other rows have it"
    ):
        read_joint_rows([path])


def test_no_rows_and_no_file(tmp_path):
    empty = tmp_path / "k.csv"
    empty.write_text(",".join([*NEEDED, *ELEMENTS]) + "\n")
    for path in (empty, tmp_path / "missing.csv"):
        with pytest.raises(InputError, match="joint-level rows"):
            read_joint_rows([path])
