from .design import Goal as Goal, Limits as Limits, design as design
from .noise_level import PilotNoise as PilotNoise, noise_named as noise_named
from .pilot import pilot_of as pilot_of
from .plan import (
    COMPARED as COMPARED,
    DURATIONS_S as DURATIONS_S,
    Plan as Plan,
    candidates_of as candidates_of,
)
from .precision import (
    INEFFICIENCY as INEFFICIENCY,
    PlannedMotion as PlannedMotion,
    precision as precision,
)
from .profile import Profile as Profile
from .setting import PlannedArm as PlannedArm, Servo as Servo, Setting as Setting
from .shapes import SHAPES as SHAPES
