"""The rows that muscle models are fitted to, and the order of their elements."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.muscles.models.packed import matrix, triple, triple_sd
from armimpedance.muscles.models.rows import JointRows

K = np.array([[[15.0, 6.0], [5.0, 16.0]], [[9.0, 2.0], [2.0, 8.0]]])


def rows(**changes):
    given = {"joint_angles": np.ones((2, 2)), "stiffness": K, "viscosity": K / 10}
    return JointRows(**(given | changes))


def test_triple_is_the_symmetric_part_and_matrix_undoes_it():
    assert triple(K)[0].tolist() == [15.0, 5.5, 16.0]
    assert matrix(triple(K)) == pytest.approx((K + K.transpose(0, 2, 1)) / 2)


def test_the_cross_terms_error_counts_two_numbers_or_one():
    # a mean of two independent numbers of sd 1 has 1/sqrt(2); one number written twice has 1
    assert triple_sd(K, np.ones_like(K))[:, 1] == pytest.approx([1 / np.sqrt(2), 1.0])
    # a mapping from the hand leaves rounding between the two: still one number
    rounded = K + np.array([[0, 3e-15], [0, 0]])
    assert triple_sd(rounded, np.ones_like(K))[1, 1] == 1.0


def test_selecting_rows_keeps_everything_together():
    alpha = np.array([[0.1, 0.2], [0.3, 0.4]])
    chosen = rows(activation=alpha, labels=("a", "b")).select([1])
    assert chosen.labels == ("b",)
    assert np.array_equal(chosen.stiffness[0], K[1])
    assert chosen.activation.tolist() == [[0.3, 0.4]]
    assert chosen.torque is None
    assert rows().select([]).n_rows == 0


def test_muscles_are_found_by_their_names_not_their_places():
    alpha = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
    named = rows(activation=alpha, activation_sd=alpha / 10, muscles=("x", "y", "z"))
    turned = named.of_muscles(("z", "x"))
    assert turned.activation.tolist() == [[0.3, 0.1], [0.6, 0.4]]
    assert turned.activation_sd == pytest.approx(turned.activation / 10)
    assert turned.select([1]).muscles == ("z", "x")
    with pytest.raises(InputError, match="no activation of w .*x, y, z"):
        named.of_muscles(("x", "w"))
    # rows of a script that names none: in the order of the arm
    assert rows(activation=alpha).of_muscles(("z", "x", "y")).activation is not None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"activation": [[0.1, 1.2], [0.1, 0.1]]}, "a: activation 1.2"),
        ({"activation": [[0.1, 0.2], [0.1, -0.1]]}, "b: activation -0.1"),
        ({"stiffness_sd": np.zeros((2, 2, 2))}, "a: a stiffness_sd of 0"),
        ({"stiffness": np.full((2, 2, 2), np.nan)}, "stiffness holds a value that is not finite"),
        ({"torque": np.ones((2, 3))}, "torque has shape"),
        ({"labels": ("a",)}, "1 labels for 2 rows"),
        ({"activation": np.ones((2, 3)), "muscles": ("x",)}, "3 activations"),
    ],
)
def test_what_cannot_be_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        rows(**({"labels": ("a", "b")} | changes))
