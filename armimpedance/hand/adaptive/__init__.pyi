from .collected import (
    RecordedTrial as RecordedTrial,
    Setup as Setup,
    recording_of as recording_of,
    trials_of as trials_of,
)
from .lines import OneCourse as OneCourse, PushSession as PushSession, answers as answers
from .next_trials import (
    NextTrials as NextTrials,
    PushingRobot as PushingRobot,
    next_trials as next_trials,
)
from .order import Comfort as Comfort, Push as Push
from .target import Aim as Aim
