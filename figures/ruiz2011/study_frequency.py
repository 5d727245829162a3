"""Not in the source: errors of K and B over the frequency at which they vary, by method."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance_figures.ruiz2011.bench import ACTIVATION, DEPTH, DURATION_S
from armimpedance_figures.ruiz2011.error_panels import LIMIT_PERCENT, Scale, draw_errors
from armimpedance_figures.ruiz2011.frequency import EXACT, NAMES, FrequencyStudy, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The highest frequency that the source allows.
PRINTED_HZ: Final = 0.7
DRAWN_ROWS: Final = (1, 0)


def draw(studies: tuple[FrequencyStudy, ...]) -> Figure:
    """K above B, a column for each joint."""
    scale = Scale(
        label="frequency of the variation (Hz)",
        ticks=tuple(studies[0].frequencies_hz),
        log=True,
        lowest=0.01,
        highest=100.0,
        marks={PRINTED_HZ: "0.7 Hz: the source's limit"},
    )
    rows = list(DRAWN_ROWS)
    return draw_errors(
        [one.joint.title for one in studies],
        [NAMES[row] for row in rows],
        [one.frequencies_hz for one in studies],
        [{m: 100 * one.median(m)[:, rows] for m in one.error} for one in studies],
        scale,
    )


def table(studies: tuple[FrequencyStudy, ...]) -> list[list[str]]:
    """One row per joint, method and frequency."""
    header = ["joint", "method", "frequency_hz", "snr_db", "draws", "draws_refused"]
    rows = [[*header, *(f"median_rms_error_{name}_percent" for name in NAMES)]]
    for one in studies:
        for method in one.error:
            percent, refused = 100 * one.median(method), one.refused(method)
            for f, frequency in enumerate(one.frequencies_hz):
                rows.append(
                    [
                        *(one.joint.name, method, number(frequency), number(one.snr_db)),
                        *(str(one.draws), str(refused[f])),
                        *map(number, percent[f]),
                    ]
                )
    return rows


def caption(studies: tuple[FrequencyStudy, ...]) -> str:
    """What is simulated, what the numbers are, and where each method ends."""
    first = studies[0]
    return (
        "Not drawn in Ruiz et al. (2011), whose section 4 names 0.7 Hz alone: rms over time of the "
        f"relative error of K(t) and B(t), median of {first.draws} records of {DURATION_S:g} s for "
        "each point. Simulated: two joints (kg m², N m s/rad, N m/rad) on a bench, random torque "
        f"behind a low-pass at 10 Hz, white noise at {first.snr_db:g} dB on both channels; B and "
        f"K vary by {100 * DEPTH:.0f} % as one sine. Constants in their mean would be wrong by "
        f"{100 * _of_a_constant(DEPTH):.0f} %. {_ends(studies)} 'emg' is given amplitudes from "
        f"simulated raw EMG of two muscles at {100 * ACTIVATION:.0f} % on average, whose sum B and "
        f"K follow exactly; '{EXACT}' the activations themselves: nearly all of the error is the "
        "randomness of EMG, at any frequency. A gap: half of the records or more were refused. "
        "Differs from the source: simulated anew, with "
        "more than one method; windows are constant as the source's are, of 0.5 s (it does not "
        "say its own), but share one I, and noise is weighed."
    )


def _of_a_constant(depth: float) -> float:
    """rms over a period of ``1 / (1 + depth sin) - 1``."""
    rest = 1 - depth**2
    return float(np.sqrt(rest**-1.5 - 2 * rest**-0.5 + 1))


def _ends(studies: tuple[FrequencyStudy, ...]) -> str:
    """Up to which frequency K is within 10 %."""
    said = []
    for method in studies[0].error:
        highest = [_highest(one, method) for one in studies]
        said.append(f"{method} {' and '.join(highest)}")
    return f"K is within {LIMIT_PERCENT:.0f} % (line) up to, in Hz, left and right: " + (
        ", ".join(said) + "."
    )


def _highest(one: FrequencyStudy, method: str) -> str:
    good = 100 * one.median(method)[:, NAMES.index("K")] <= LIMIT_PERCENT
    if good.all():
        return f"{one.frequencies_hz[-1]:g} or more"
    first_bad = int(good.argmin())
    return f"{one.frequencies_hz[first_bad - 1]:g}" if first_bad else "none"


FIGURE = SourceFigure(
    "elbow_study_frequency", ("elbow_frequency",), "", draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
