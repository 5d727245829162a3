from .chain import Chain as Chain, base_motion as base_motion
from .segments import ELBOW as ELBOW, SHOULDER as SHOULDER
from .subject import (
    PASSIVE_SUBJECTS as PASSIVE_SUBJECTS,
    PassiveSubject as PassiveSubject,
    find_passive_subject as find_passive_subject,
    passive_subject as passive_subject,
)
from .swing import (
    simulate_passive as simulate_passive,
    simulate_passive_many as simulate_passive_many,
)
from .truth import PassiveTruth as PassiveTruth
