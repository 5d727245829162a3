"""Venture (elbow), Fig. 4: how silent biceps and triceps are while the body is shaken."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.joint.relaxed.show import plot_emg_level
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.venture_elbow.study import SUBJECTS, StudiedTest, study

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(tests: tuple[StudiedTest, ...]) -> Figure:
    """Both muscles of the first subject, one below the other."""
    one = tests[0]
    figure: Figure = plot_emg_level(one.emg, one.level)[0].figure
    return figure


def caption(tests: tuple[StudiedTest, ...]) -> str:
    """What is shown and what differs."""
    one, level = tests[0], tests[0].level
    said = ", ".join(
        f"{muscle} {mean:.1f} % on average, {high:.1f} % in its highest second"
        for muscle, mean, high in zip(
            level.muscles,
            level.mean_percent.mean(axis=0),
            level.highest_percent.max(axis=0),
            strict=True,
        )
    )
    return (
        "After Venture et al. (in-vivo elbow), Fig. 4: EMG of biceps and triceps during test P5, "
        f"rectified, second-order Butterworth low-pass {level.envelope_hz:g} Hz forward and "
        f"backward, % of the maximum (thin, without the filter's ends), its mean over "
        f"{level.window_s:g} s (thick), and the gate above which a recording is refused (dashed): "
        f"{said}. Simulated subject {one.subject}: noise of "
        "20-450 Hz at 1 kHz whose rectified mean is 2 % of the maximum, the level that the source "
        "reads off its own figure; no muscle contracts. Differs from the source: simulated; % "
        "instead of 0 < u < 1; the source states no gate."
    )


FIGURE = SourceFigure("venture_elbow_fig04", ("p5",), SUBJECTS, draw, caption, study=study)

if __name__ == "__main__":
    script(FIGURE)
