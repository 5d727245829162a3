from .choice import Need as Need, Session as Session, needed as needed
from .collected import (
    Setup as Setup,
    Trial as Trial,
    recording_of as recording_of,
    trials_of as trials_of,
)
from .lines import OneCourse as OneCourse, PushSession as PushSession, answers as answers
from .menu import (
    Menu as Menu,
    lines_of as lines_of,
    menu_of as menu_of,
    spread_evenly as spread_evenly,
)
from .next_trials import (
    NextTrials as NextTrials,
    Robot as Robot,
    best_session as best_session,
    next_trials as next_trials,
)
from .order import Comfort as Comfort, Push as Push
from .so_far import SoFar as SoFar, so_far as so_far
from .target import Aim as Aim, Target as Target, targets_of as targets_of
