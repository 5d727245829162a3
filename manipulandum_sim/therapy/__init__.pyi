from .calibration import (
    simulate_calibration as simulate_calibration,
    simulate_validation as simulate_validation,
)
from .device import TherapyDevice as TherapyDevice, therapy_device as therapy_device
from .mockup import simulate_mockup as simulate_mockup
from .plan import TherapyOptions as TherapyOptions
from .plant import Progress as Progress
from .session import (
    simulate_therapy as simulate_therapy,
    simulate_therapy_many as simulate_therapy_many,
)
from .subject import THERAPY_SUBJECTS as THERAPY_SUBJECTS
from .truth import TherapyTruth as TherapyTruth, TrueContribution as TrueContribution
