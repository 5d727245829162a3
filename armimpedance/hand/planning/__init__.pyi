from .design import Goal as Goal, Limits as Limits, design as design
from .noise_level import noise_named as noise_named
from .pilot import pilot_of as pilot_of
from .plan import Plan as Plan
from .precision import PlannedMotion as PlannedMotion, precision as precision
from .profile import Profile as Profile
from .setting import PlannedArm as PlannedArm, Servo as Servo, Setting as Setting
from .shapes import SHAPES as SHAPES
