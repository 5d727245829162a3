"""The reflex guard's figure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still.reflex import guard_window
from armimpedance.hand.still.show.reflex_plot import (
    MOST_GROUPS,
    plot_delay_profile,
    plot_reflex,
    plot_window_ends,
)
from armimpedance.numerics.signals.windows import cut_windows


@pytest.fixture(scope="module")
def verdict(limb):
    recording = limb.record(sets=2, duration=0.15, force_noise=0.3)
    return guard_window(cut_windows(recording), "hand", keys={"condition": "quiet"})


def test_ends_show_both_principal_values_with_bands_and_end_at_the_record(verdict):
    ax = plot_window_ends(verdict)
    lines = {line.get_label(): line for line in ax.lines}
    last = verdict.ends.stiffness[-1]
    values = np.linalg.eigvalsh((last + last.T) / 2)
    for name, value in zip(("smallest", "largest"), values, strict=True):
        assert lines[name].get_ydata()[-1] == pytest.approx(value)
        assert lines[name].get_xdata()[-1] == pytest.approx(1e3 * verdict.ends.end_s[-1])
    assert len(ax.collections) == 2
    assert "N/m" in ax.get_ylabel()
    assert "ms" in ax.get_xlabel()


def test_a_reflex_adds_its_delay_and_the_intrinsic_values(verdict):
    found = replace(verdict, outcome="contaminated", delay_s=0.05, delay_low_s=0.04)
    ax = plot_window_ends(found)
    # dotted and solid for each value, the delay, two intrinsic values
    assert len(ax.lines) == 4 + 1 + 2
    assert len(ax.patches) == 1
    dashed = [line.get_ydata()[0] for line in ax.lines if line.get_color() == "black"]
    own = np.linalg.eigvalsh((found.intrinsic + found.intrinsic.T) / 2)
    np.testing.assert_allclose(sorted(dashed), own)


def test_profile_is_that_of_the_verdict(verdict):
    ax = plot_delay_profile(verdict)
    curve = ax.lines[-1]
    np.testing.assert_allclose(curve.get_ydata(), verdict.profile.log_ratio)
    np.testing.assert_allclose(curve.get_xdata(), 1e3 * verdict.profile.delay_s)
    low, high = ax.get_ylim()
    assert low <= -3
    assert high >= 5


def test_a_row_for_each_group_and_of_many_the_most_telling(verdict):
    assert plot_reflex([verdict]).shape == (1, 2)
    many = [replace(verdict, keys={"c": n}, p_value=1 / (1 + n)) for n in range(MOST_GROUPS + 2)]
    axes = plot_reflex(many)
    assert axes.shape == (MOST_GROUPS, 2)
    assert axes[0, 0].get_title(loc="left").split("\n")[0] == str(MOST_GROUPS + 1)
    # on a page beside its text
    assert axes[0, 0].figure.get_figheight() < 6


def test_refuses_what_it_cannot_draw(verdict):
    with pytest.raises(InputError, match="no verdicts"):
        plot_reflex([])
    with pytest.raises(InputError, match="without window ends"):
        plot_window_ends(replace(verdict, ends=None))
