from .design import Goal as Goal, Limits as Limits, design as design
from .motion import PlannedMotion as PlannedMotion
from .noise_level import (
    NOISE_LEVELS as NOISE_LEVELS,
    NOMINAL as NOMINAL,
    noise_named as noise_named,
)
from .pilot import pilot_of as pilot_of
from .plan import (
    COMPARED as COMPARED,
    DURATIONS_S as DURATIONS_S,
    Candidate as Candidate,
    Plan as Plan,
    Wish as Wish,
    candidates_of as candidates_of,
    judge_pilot as judge_pilot,
    make_plan as make_plan,
    within as within,
)
from .precision import Precision as Precision, precision as precision
from .profile_csv import write_profile as write_profile
from .servo import Servo as Servo
from .setting import PlannedArm as PlannedArm, Setting as Setting, relaxed_arm as relaxed_arm
from .shapes import Profile as Profile, shape_named as shape_named
