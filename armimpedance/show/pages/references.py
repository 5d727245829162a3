"""The sources of the methods, as a list of references names them."""

from __future__ import annotations

from typing import Final

TSUJI: Final = "T. Tsuji, Human arm impedance in multi-joint movements (1997)."
VENTURE_ELBOW: Final = (
    "G. Venture and colleagues, In-vivo estimation of the human elbow joint dynamics during "
    "passive movements using musculo-skeletal model computations."
)
VENTURE_BODY: Final = "G. Venture, Dynamics identification of human-like systems (poster)."
RUIZ: Final = "A. F. Ruiz and colleagues (2011), on a powered elbow exoskeleton."
GUIDALI: Final = (
    "M. Guidali and colleagues, Estimating the patient's contribution during robot-assisted "
    "therapy (2013)."
)
