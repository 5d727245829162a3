"""M, B, K and a reflex of a hand, wrist or ankle under random perturbations in two or three axes.

Examples:
  armimpedance simulate random --out session              something to try it on
  armimpedance random session --out hand.csv --figure response.png
  armimpedance simulate random --axes 3 --imposed force --reflex 0.25 --out session
  armimpedance random session --band 2 15 --out hand.json
  armimpedance simulate wrist --out wrist                 about two axes, N m and rad
  armimpedance random wrist --out wrist.csv

The robot moves the limb, or pushes it, at random along all axes for seconds to minutes.
recording.json says "perturbation": "stochastic"; the columns command_x, command_y and command_z of
the samples (of joints q1_command_rad or tau1_perturbation_Nm, and so on) hold what the robot was
told, in any unit: they tell what the limb does of its own accord from what was done to it. A
recording without them is taken where recording.json says "imposed": "position".

K is what answers at once; a delayed answer, where the record shows one, is told beside it with its
delay. Where it cannot be decided the intervals hold both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from armimpedance.hand.random.show.verb import RANDOM
from armimpedance.show.command.verb import Command

if TYPE_CHECKING:
    from armimpedance.hand.random.show.random_estimates import RandomEstimates


def _draw(estimates: RandomEstimates) -> Any:
    """Draw the response of the first group."""
    from armimpedance.hand.random.show.plot import plot_response_matrix

    return plot_response_matrix(estimates.fits[0])


_COMMAND: Final = Command(
    RANDOM,
    progress="fitting {recording}",
    call="armimpedance.hand.random.show.verb:random",
    out="the results, one row a group",
    text="armimpedance.hand.show.text:summary_table",
    figure="impedance over frequency with bands, coherence, and the model",
    draw=_draw,
    caption="Size of each element of the impedance over frequency, without a model (points with "
    "95 % bands) and by M, B, K and the reflex (lines), of the first group; at the top the "
    "coherence of each force with the motion of all axes.",
    rows=len,
)
configure, run = _COMMAND.configure, _COMMAND.run
