"""Moment arms from a table: splines, what the file may hold, what it may not."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.limb.arm.polynomial_paths import PolynomialPaths, monomial_exponents
from armimpedance.limb.arm.table_paths import EQUAL_TENSION_N, TablePaths, read_moment_arm_table

SHOULDER, ELBOW = np.deg2rad(np.arange(0, 91, 15)), np.deg2rad(np.arange(30, 121, 15))
HEADER = "muscle,q_shoulder_rad,q_elbow_rad,G_shoulder_m,G_elbow_m"


def cubic_arms():
    """Three two-joint muscles whose arms are polynomials of order 3 of both angles."""
    exponents = monomial_exponents(2, 4)
    c = np.random.default_rng(0).standard_normal((3, len(exponents)))
    c = 0.03 * c / 2 ** exponents.sum(axis=1)
    return PolynomialPaths(("a", "b", "c"), exponents, c, np.array([[0.0, 1.6], [0.5, 2.1]]))


def on_grid(arms):
    q = np.stack(np.meshgrid(SHOULDER, ELBOW, indexing="ij"), axis=-1)
    return np.moveaxis(arms(q), 2, 0)


def table(arms=None, muscles=("a", "b", "c")):
    return TablePaths(muscles, SHOULDER, ELBOW, on_grid(arms or cubic_arms().moment_arms))


def inside(count=50, seed=2):
    low, high = [SHOULDER[0], ELBOW[0]], [SHOULDER[-1], ELBOW[-1]]
    return np.random.default_rng(seed).uniform(low, high, (count, 2))


def test_cubic_arms_come_back_exactly_between_the_nodes():
    truth, paths, q = cubic_arms(), table(), inside().reshape(5, 10, 2)
    np.testing.assert_allclose(paths.moment_arms(q), truth.moment_arms(q), atol=1e-15)
    np.testing.assert_allclose(paths.curvature(q), truth.curvature(q), atol=1e-13)
    assert paths.inconsistency.max() < 1e-10


def test_smooth_arms_are_met_within_the_error_of_a_cubic_spline():
    def arms(q):
        s = -0.04 * (1 + 0.3 * np.cos(q[..., 0] - 0.5))
        e = 0.03 * (1 + 0.3 * np.cos(q[..., 1] - 1.2))
        return np.stack([s, e], axis=-1)[..., None, :]

    paths, q = table(arms, ("wave",)), inside()
    # 5/384 h^4 times the fourth derivative, tenfold near the ends
    assert np.abs(paths.moment_arms(q) - arms(q)).max() < 0.13 * 0.262**4 * 0.012
    assert paths.curvature(q)[:, 0, 0, 1] == pytest.approx(0, abs=1e-12)


def test_arms_with_a_circulation_are_refused_and_small_errors_are_not():
    truth = cubic_arms().moment_arms

    def whirl(q, strength):
        extra = strength * np.stack([q[..., 1] - 1.3, 0.8 - q[..., 0]], axis=-1)
        return truth(q) + extra[..., None, :]

    with pytest.raises(InputError, match="no length has these moment arms"):
        table(lambda q: whirl(q, 0.03))
    slight = table(lambda q: whirl(q, 0.001))
    assert (slight.inconsistency > 1e-5).all()
    size = np.sqrt((slight.arms**2).sum(axis=-1).mean(axis=(1, 2)))
    assert (slight.inconsistency < 0.1 * size).all()
    # no matter what circulates, what is handed on is symmetric
    C = slight.curvature(inside())
    np.testing.assert_array_equal(C, np.swapaxes(C, -1, -2))


@pytest.mark.parametrize(
    ("q", "words"),
    [
        ([-0.1, 1.0], ["shoulder at -5.7", "0.0 to 90.0"]),
        ([1.0, 2.2], ["elbow at 126.1", "30.0 to 120.0"]),
    ],
)
def test_a_posture_outside_of_the_table_is_refused_by_name_and_range(q, words):
    for method in (table().moment_arms, table().curvature):
        with pytest.raises(InputError) as told:
            method([[1.0, 1.0], q])
        assert all(word in str(told.value) for word in words)


def test_the_table_s_own_border_is_inside():
    corner = [[SHOULDER[0], ELBOW[-1]], [SHOULDER[-1], ELBOW[0]]]
    assert np.isfinite(table().moment_arms(corner)).all()


def lines(extra_header="", extra=("", "", "")):
    """The rows of a good file."""
    G = on_grid(cubic_arms().moment_arms)
    rows = [HEADER + extra_header]
    for m, muscle in enumerate("abc"):
        for i, s in enumerate(SHOULDER):
            for j, e in enumerate(ELBOW):
                numbers = ",".join(repr(float(v)) for v in (s, e, *G[m, i, j]))
                rows.append(f"{muscle},{numbers}{extra[m]}")
    return rows


@pytest.fixture
def written(tmp_path):
    def write(rows):
        path = tmp_path / "arms.csv"
        path.write_text("\n".join(rows) + "\n", encoding="utf-8")
        return path

    return write


def test_a_file_becomes_an_arm(written):
    arm = read_moment_arm_table(written(["# made by hand", *lines()]))
    assert arm.name == "arms"
    assert arm.paths.muscles == ("a", "b", "c")
    np.testing.assert_allclose(
        arm.paths.moment_arms(inside()), cubic_arms().moment_arms(inside()), atol=1e-15
    )
    np.testing.assert_array_equal(arm.max_tension, EQUAL_TENSION_N)
    assert arm.stiffness_per_tension == 75
    assert "equally strong" in arm.source
    np.testing.assert_allclose(np.rad2deg(arm.angle_range), [[0, 90], [30, 120]])


def test_tension_and_stiffness_columns_are_taken(written):
    rows = lines(",max_tension_N,stiffness_per_tension_per_m", (",197,60", ",198,60", ",199,60"))
    arm = read_moment_arm_table(written(rows))
    np.testing.assert_array_equal(arm.max_tension, [197, 198, 199])
    assert arm.stiffness_per_tension == 60
    assert "strong" not in arm.source


def test_rows_in_any_order_and_angles_with_fewer_digits(written):
    rows = lines()
    rows[1] = rows[1].replace(repr(float(ELBOW[0])), f"{ELBOW[0]:.7f}")
    shuffled = [rows[0], *np.random.default_rng(0).permutation(rows[1:])]
    arm = read_moment_arm_table(written(shuffled))
    q = inside()
    index = [arm.paths.muscles.index(name) for name in "abc"]
    np.testing.assert_allclose(
        arm.paths.moment_arms(q)[:, index], cubic_arms().moment_arms(q), atol=1e-7
    )


def damaged(rows, line, column, text):
    """The rows with one cell replaced; `line` as an editor counts."""
    cells = rows[line - 1].split(",")
    cells[rows[0].split(",").index(column)] = text
    return [*rows[: line - 1], ",".join(cells), *rows[line:]]


@pytest.mark.parametrize(
    ("column", "text", "word"),
    [
        ("G_shoulder_m", "abc", "'abc'"),
        ("G_elbow_m", "", "empty cell"),
        ("G_elbow_m", "nan", "'nan'"),
        ("G_elbow_m", "-38.2", "at most 0.2"),
        ("q_elbow_rad", "90", "rad"),
        ("q_shoulder_rad", "1e999", "'1e999'"),
        ("muscle", "", "a name"),
    ],
)
def test_a_bad_cell_is_named_by_file_row_and_column(written, column, text, word):
    path = written(damaged(lines(), 7, column, text))
    with pytest.raises(InputError) as told:
        read_moment_arm_table(path)
    message = str(told.value)
    assert f"{path}, row 7, column {column}" in message
    assert word in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r[:0], ["is empty"]),
        (lambda r: r[:1], ["no rows"]),
        (lambda r: [r[0].replace("G_elbow_m", "arm"), *r[1:]], ["column G_elbow_m"]),
        (lambda r: [r[0] + ",muscle", *(x + ",a" for x in r[1:])], ["appears twice"]),
        (lambda r: [*r[:9], *r[10:]], ["no row for a", "1 of 147"]),
        (lambda r: [*r, r[4]], ["row 149", "again"]),
        (lambda r: [*r[:5], r[5] + ",7", *r[6:]], ["row 6", "6 cells"]),
        (lambda r: [x for x in r if not x.startswith("b,0.0,")], ["no row for b"]),
        (
            lambda r: [r[0], *(x for x in r[1:] if float(x.split(",")[1]) < 0.6)],
            ["3 angles of the shoulder", "at least 4"],
        ),
    ],
)
def test_a_bad_table_is_told_in_one_line(written, change, words):
    path = written(change(lines()))
    with pytest.raises(InputError) as told:
        read_moment_arm_table(path)
    message = str(told.value)
    assert all(word in message for word in (str(path), *words))
    assert "\n" not in message


@pytest.mark.parametrize("column", ["max_tension_N", "stiffness_per_tension_per_m"])
def test_constants_that_change_or_are_not_positive_are_refused(written, column):
    rows = lines(f",{column}", (",500",) * 3)
    for text, word in (("501", "one value for"), ("-500", "positive"), ("0", "positive")):
        with pytest.raises(InputError) as told:
            read_moment_arm_table(written(damaged(rows, 12, column, text)))
        assert f"row 12, column {column}" in str(told.value)
        assert word in str(told.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_moment_arm_table(tmp_path / "none.csv")
