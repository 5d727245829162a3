from .estimates import Estimates as Estimates
from .labelled import LabelledEstimate as LabelledEstimate, LabelledMatrix as LabelledMatrix
from .sources import (
    naming as naming,
    of_condition as of_condition,
    read as read,
    read_recording as read_recording,
)
