"""Conditions and directions of Kinarm exams, from tables as laboratories fill them."""

from __future__ import annotations

import kinarm_bench as bench
import numpy as np
import pytest

from armimpedance.show.verbs.results import read

FILL = 100


@pytest.fixture
def table(c3d):
    """A table of an exam from its columns, each filled up as Dexterit-E does."""

    def made(**columns):
        used = max(len(values) for values in columns.values())
        parameters = {"USED": c3d.shorts(used, sizes=()), "COLUMN_ORDER": c3d.texts(*columns)}
        for name, values in columns.items():
            if any(isinstance(value, str) for value in values):
                parameters[name] = c3d.texts(*values)
            else:
                filled = [*values, *[0.0] * (FILL - len(values))]
                parameters[name] = c3d.floats(*filled, sizes=(10, 10))
        return parameters

    return made


@pytest.fixture
def conditions(exams, tmp_path):
    """Condition and direction of each trial of an exam that ran these rows of its tables."""

    def of(tables, rows, *, side="Right", names=None, **options):
        trials = [
            exams.Trial(
                f"01_{row:02d}_{i:02d}.c3d",
                samples=60,
                trial_num=i,
                events=(),
                side=side,
                tp="" if names is None else names[i - 1],
            )
            for i, row in enumerate(rows, start=1)
        ]
        folder = tmp_path / f"exam{len(list(tmp_path.iterdir()))}"
        exams.folder(folder, exams.files(trials, exams.Robot(tables=tables)))
        table = read(folder, force_by="limb", **options).trials
        directions = table["direction_deg"].tolist() if "direction_deg" in table else None
        return table["condition"].tolist(), directions, table

    return of


AROUND = 2 * np.pi * np.arange(8) / 8
FORCES = {"FORCE_X": 6 * np.cos(AROUND), "FORCE_Y": 6 * np.sin(AROUND)}


def test_names_of_protocols_are_the_conditions(table, conditions):
    tables = {"TP_TABLE": table(NAME=["weich", "stark über", "αβ"], DELAY=[1, 2, 3])}
    assert conditions(tables, [1, 2, 3, 2])[0] == ["weich", "stark über", "αβ", "stark über"]


def test_one_name_for_all_does_not_mix_what_differs(table, conditions):
    loads = {"FORCE_X": [2.0, 6.0], "FORCE_Y": [0.0, 0.0]}
    tables = {
        "TP_TABLE": table(NAME=["reach"] * 3, LOAD=[1, 2, 2]),
        "LOAD_TABLE": table(**loads),
    }
    names, directions, _ = conditions(tables, [1, 2, 3])
    assert names == ["reach load 2 N", "reach load 6 N", "reach load 6 N"]
    assert directions == [0.0, 0.0, 0.0]


def test_one_name_for_all_directions_is_one_condition(table, conditions):
    tables = {
        "TP_TABLE": table(NAME=["reach"] * 8, LOAD=range(1, 9)),
        "LOAD_TABLE": table(**FORCES),
    }
    names, directions, _ = conditions(tables, range(1, 9))
    assert set(names) == {"reach"}
    np.testing.assert_allclose(directions, 45.0 * np.arange(8), atol=1e-3)


def test_names_of_trials_count_before_those_of_the_table(table, conditions):
    tables = {"TP_TABLE": table(NAME=["a", "b"])}
    assert conditions(tables, [1, 2], names=["first", "second"])[0] == ["first", "second"]
    # A number is no name, and an empty one neither.
    assert conditions(tables, [1, 2], names=["1", "2"])[0] == ["a", "b"]
    assert conditions({"TP_TABLE": table(NAME=["", " "])}, [1, 2])[0] == ["TP_1", "TP_2"]


def test_sizes_of_loads_and_ways_are_told_in_their_units(table, conditions):
    strong = {name: np.concatenate([force, force / 3]) for name, force in FORCES.items()}
    tables = {"TP_TABLE": table(LOAD=range(1, 17)), "LOAD_TABLE": table(**strong)}
    names = conditions(tables, range(1, 17))[0]
    assert names == ["load 6 N"] * 8 + ["load 2 N"] * 8
    ways = {"X_GLOBAL": [1.0, 6.0, 1.0, 1.0], "Y_GLOBAL": [40.0, 40.0, 45.0, 30.0]}
    tables = {
        "TP_TABLE": table(START_TARGET=[1] * 3, END_TARGET=[2, 3, 4]),
        "TARGET_TABLE": table(**ways),
    }
    names, directions, _ = conditions(tables, [1, 2, 3])
    assert names == ["target 5 cm", "target 5 cm", "target 10 cm"]
    np.testing.assert_allclose(directions, [0.0, 90.0, 270.0], atol=1e-3)


def test_postures_are_told_by_their_places(table, conditions):
    tables = {
        "TP_TABLE": table(TARGET=[1, 2, 1], DELAY=[0.5, 0.5, 0.7]),
        "TARGET_TABLE": table(X_GLOBAL=[-12.5, 12.5], Y_GLOBAL=[40.0, 38.0]),
    }
    names, directions, trials = conditions(tables, [1, 2, 3])
    assert names[:2] == ["TP_1 target -12.5 40 cm", "TP_2 target 12.5 38 cm"]
    assert directions is None
    np.testing.assert_allclose(trials["target_x_m"], [-0.125, 0.125, -0.125], atol=1e-9)


def test_with_loads_a_protocol_without_one_has_no_direction(table, conditions):
    """A catch trial goes to a target like the others; nothing pushes it."""
    places = {
        "X_GLOBAL": [0.0, *10 * np.cos(AROUND)],
        "Y_GLOBAL": [40.0, *(40 + 10 * np.sin(AROUND))],
    }
    tables = {
        "TP_TABLE": table(START_TARGET=[1] * 3, END_TARGET=[2, 3, 4], LOAD=[0, 1, 3]),
        "TARGET_TABLE": table(**places),
        "LOAD_TABLE": table(**FORCES),
    }
    names, directions, _ = conditions(tables, [1, 2, 3])
    assert directions is None
    assert names[0].startswith("TP_1 target 10 cm at 0 deg")
    # Without the catch trials the loads' directions are there.
    chosen = conditions(tables, [1, 2, 3], where="TP != 1")
    np.testing.assert_allclose(chosen[1], [0.0, 90.0], atol=1e-3)
    assert chosen[0] == names[1:]


def test_pushes_stay_together_beside_trials_without_one(table, conditions):
    tables = {
        "TP_TABLE": table(LOAD=[*range(1, 9), 0, 9], DELAY=[1.0] * 8 + [2.0, 3.0]),
        "LOAD_TABLE": table(**{name: [*force, 0.0] for name, force in FORCES.items()}),
    }
    names = conditions(tables, range(1, 11))[0]
    assert names == ["TP_1 to TP_8"] * 8 + ["TP_9", "TP_10 load 0 N"]
    # Under a name of their own, those without a push are no pushes.
    tables["TP_TABLE"]["NAME"] = table(NAME=["hold"] * 10)["NAME"]
    assert len(set(conditions(tables, range(1, 11))[0])) == 3


def test_targets_from_an_origin_of_the_task_give_the_way(table, conditions):
    tables = {
        "TP_TABLE": table(HOME_TARGET=[1, 1], REACH_TARGET=[2, 3]),
        "TARGET_TABLE": table(X=[0.0, 3.0, 0.0], Y=[0.0, 4.0, -2.0]),
    }
    names, directions, trials = conditions(tables, [1, 2])
    np.testing.assert_allclose(directions, [np.rad2deg(np.arctan2(4, 3)), 270.0], atol=1e-3)
    assert names == ["TP_1 target 5 cm at 53.1 deg", "TP_2 target 2 cm at 270 deg"]
    assert not [column for column in trials if str(column).endswith("_x_m")]
    # Of a left arm nobody knows whether such a table is mirrored.
    assert conditions(tables, [1, 2], side="Left")[1] is None


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ("START_TARGET", "END_TARGET"),
        ("STARTTARGET", "ENDTARGET"),
        ("INIT_TARGET", "DESTINATION_TARGET"),
        ("HOME_TARGET", "REACH_TARGET"),
        ("CENTER_TARGET", "GOALTARGET"),
        ("TARGET_START", "TARGET_END"),
    ],
)
def test_targets_by_the_names_that_laboratories_give_them(table, conditions, start, end):
    tables = {
        "TP_TABLE": table(**{start: [1, 1], end: [2, 3], "TARGET_DELAY": [1, 1]}),
        "TARGET_TABLE": table(X_GLOBAL=[1.0, 6.0, 1.0], Y_GLOBAL=[40.0, 40.0, 35.0]),
    }
    names, directions, trials = conditions(tables, [1, 2])
    assert directions == [0.0, 270.0]
    assert set(names) == {"TP_1 to TP_2"}
    assert "target_delay_x_m" not in trials


def test_a_left_arm_is_told_in_the_frame_of_its_recording(table, conditions):
    tables = {
        "TP_TABLE": table(TARGET=[1, 1], LOAD=[1, 2]),
        "TARGET_TABLE": table(X_GLOBAL=[12.0], Y_GLOBAL=[40.0]),
        "LOAD_TABLE": table(FORCE_X=[4.0, 0.0], FORCE_Y=[0.0, 3.0]),
    }
    names, directions, trials = conditions(tables, [1, 2], side="Left")
    assert names[0] == "TP_1 target -12 40 cm load 4 N at 180 deg"
    np.testing.assert_allclose(directions, [180.0, 90.0], atol=1e-3)
    assert trials["load_force_x"].tolist() == [4.0, 0.0]


def test_several_loads_in_one_protocol(table, conditions):
    loads = {"FORCE_X": [0.0, 5.0, 0.0], "FORCE_Y": [0.0, 0.0, 7.0]}
    tables = {
        "TP_TABLE": table(HOLD_LOAD=[1, 1], PERT_LOAD=[2, 3]),
        "LOAD_TABLE": table(**loads, RAMP=[0.1, 0.2, 0.2]),
    }
    names, directions, trials = conditions(tables, [1, 2])
    # The one that pushes is the disturbance.
    np.testing.assert_allclose(directions, [0.0, 90.0], atol=1e-3)
    assert names == [
        "TP_1 hold_load 0 N pert_load 5 N at 0 deg",
        "TP_2 hold_load 0 N pert_load 7 N at 90 deg",
    ]
    assert trials["pert_load_force_y"].tolist() == [0.0, 7.0]
    assert trials["hold_load_ramp"].tolist() == [0.1, 0.1]
    # Two that push say no direction.
    tables["LOAD_TABLE"] = table(**(loads | {"FORCE_X": [1.0, 5.0, 0.0]}))
    assert conditions(tables, [1, 2])[1] is None


def test_of_two_forces_in_a_load_neither_is_guessed(table, conditions):
    tables = {
        "TP_TABLE": table(LOAD=[1, 2]),
        "LOAD_TABLE": table(
            BIAS_FORCE_X=[1.0, 1.0],
            BIAS_FORCE_Y=[0.0, 0.0],
            PERT_FORCE_X=[0.0, 5.0],
            PERT_FORCE_Y=[5.0, 0.0],
        ),
    }
    names, directions, _ = conditions(tables, [1, 2])
    assert directions is None
    assert len(set(names)) == 2
    exact = table(FORCE_X=[5.0, 0.0], FORCE_Y=[0.0, 5.0], BIAS_FORCE_X=[1, 1], BIAS_FORCE_Y=[1, 1])
    assert conditions({**tables, "LOAD_TABLE": exact}, [1, 2])[1] == [0.0, 90.0]


def test_loads_that_are_torques_keep_their_rows_apart(table, conditions):
    tables = {
        "TP_TABLE": table(LOAD=[1, 2, 1]),
        "LOAD_TABLE": table(SHOULDER_TORQUE=[1.0, -1.0], ELBOW_TORQUE=[0.0, 2.0]),
    }
    names, directions, trials = conditions(tables, [1, 2, 2])
    assert directions is None
    assert names == [
        "TP_1 load shoulder_torque 1",
        *["TP_2 load shoulder_torque -1, load elbow_torque 2"] * 2,
    ]
    assert trials["load_elbow_torque"].tolist() == [0.0, 2.0, 2.0]


@pytest.mark.parametrize(
    "tables",
    [
        {"TP_TABLE": {"LOAD": [9.0]}, "LOAD_TABLE": {"FORCE_X": [1.0], "FORCE_Y": [0.0]}},
        {"TP_TABLE": {"LOAD": [1.5]}, "LOAD_TABLE": {"FORCE_X": [1.0], "FORCE_Y": [0.0]}},
        {"TP_TABLE": {"LOAD": [-1.0]}, "LOAD_TABLE": {"FORCE_X": [1.0], "FORCE_Y": [0.0]}},
        {"TP_TABLE": {"LOAD": [3e38]}, "LOAD_TABLE": {"FORCE_X": [1.0], "FORCE_Y": [0.0]}},
        {"TP_TABLE": {"LOAD": [float("nan")]}},
        {"TP_TABLE": {"START_TARGET": [1.0], "END_TARGET": [2.0]}},
        {"TP_TABLE": {"DIRECTION_DEG": ["north"]}},
        {"TP_TABLE": {"LOAD": ["strong"], "TARGET": ["left"]}},
        {"TP_TABLE": {"LOAD": [1.0]}, "LOAD_TABLE": {"FORCE_X": ["a"], "FORCE_Y": ["b"]}},
        {"TP_TABLE": {"": [1.0], "LOAD": [1.0]}, "LOAD_TABLE": {"FX": [float("inf")], "FY": [0.0]}},
    ],
)
def test_tables_that_cannot_be_leave_the_trials_as_they_are(table, conditions, tables):
    made = {name: table(**columns) for name, columns in tables.items()}
    names, directions, _ = conditions(made, [1, 1])
    assert len(set(names)) == 1
    assert names[0].startswith("TP_1")
    assert directions is None


def test_a_direction_that_is_stated_counts_first(table, conditions):
    tables = {
        "TP_TABLE": table(DIRECTION_DEG=[30.0, 210.0], LOAD=[1, 3]),
        "LOAD_TABLE": table(**FORCES),
    }
    assert conditions(tables, [1, 2])[1] == [30.0, 210.0]
    assert conditions(tables, [1, 2], side="Left")[1] == [150.0, 330.0]


def test_a_condition_keeps_its_name_whichever_trials_are_chosen(c3d, conditions):
    tables = bench.tables_of(c3d)
    whole = conditions(tables, range(1, 9))[2]
    for options in ({"protocols": (2, 5)}, {"where": "TP in (2, 5)"}):
        part = conditions(tables, range(1, 9), **options)[2]
        named = whole.set_index("trial")["condition"]
        assert part["condition"].tolist() == named[part["trial"]].tolist()
        # And a condition can be asked for by the name that it has.
    name = whole["condition"][3]
    assert conditions(tables, range(1, 9), where=f"condition == {name!r}")[0] == [name]
