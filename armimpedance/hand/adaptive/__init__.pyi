from .collected import (
    Setup as Setup,
    Trial as Trial,
    recording_of as recording_of,
    trials_of as trials_of,
)
from .lines import OneCourse as OneCourse, PushSession as PushSession, answers as answers
from .next_trials import (
    NextTrials as NextTrials,
    Robot as Robot,
    next_trials as next_trials,
)
from .order import Comfort as Comfort, Push as Push
from .target import Aim as Aim
