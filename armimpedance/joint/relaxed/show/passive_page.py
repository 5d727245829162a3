"""Stiffness, viscosity and friction of relaxed joints."""

from __future__ import annotations

from armimpedance.core.program import software
from armimpedance.joint.relaxed.methods import METHODS
from armimpedance.joint.relaxed.show.plot import plot_passive_fits
from armimpedance.joint.relaxed.show.text import passive_text
from armimpedance.joint.relaxed.show.verb import PASSIVE, passive
from armimpedance.show.pages import VENTURE_ELBOW, Asked, Page, Topic, fit_page, picture
from armimpedance.show.text import counted


def page_of(asked: Asked) -> Page:
    """The page of relaxed joints, whose rest angles are fitted."""
    chosen = PASSIVE.chosen(asked)
    fits = passive(asked.recording, **chosen, progress=asked.progress)
    used = fits[0]
    method = METHODS.named(used.method)
    filtered = "no filter" if used.cutoff_hz is None else f"a low-pass of {used.cutoff_hz:g} Hz"
    joints = ", ".join(fit.joint for fit in fits)
    return fit_page(
        asked,
        fits.summary,
        title="Passive joints",
        lead=f"{counted(len(fits), 'relaxed joint')}: {joints}.",
        pictures=[
            picture(
                plot_passive_fits(fits),
                "passive_torque",
                "Passive torque over time: measured and as the fitted parameters give it.",
            )
        ],
        printed=passive_text(fits),
        methods=[
            f"Stiffness k, viscosity h, friction f and rest angle q_r of {joints} were fitted to "
            f"the passive torque k (q - q_r) + h q' + f sign(q') with {software()}, method "
            f"{used.method} ({method.reference})",
            f"Kinematics went through {filtered}",
            *PASSIVE.differing(chosen),
            *fits.notes,
            "Intervals are 95 % intervals that count the correlation of the residuals and what is "
            "not known of the limb's mass",
        ],
        references=[VENTURE_ELBOW, method.reference],
        options=[("cut-off (Hz)", used.cutoff_hz), ("despite", ", ".join(asked.despite))],
    )


TOPIC = Topic("stiffness, viscosity and friction of relaxed joints", page_of)
