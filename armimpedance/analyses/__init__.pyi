from .comparison import Comparison as Comparison, compare as compare
from .contents import describe as describe
from .estimates import Estimates as Estimates
from .hand import (
    ComparedMethods as ComparedMethods,
    ReflexVerdicts as ReflexVerdicts,
    estimate as estimate,
    estimate_all as estimate_all,
    reflex as reflex,
)
from .inspection import Finding as Finding, Inspection as Inspection, inspect as inspect
from .labelled import LabelledEstimate as LabelledEstimate, LabelledMatrix as LabelledMatrix
from .sources import (
    naming as naming,
    of_condition as of_condition,
    read as read,
    read_recording as read_recording,
)
