from .candidate import Candidate as Candidate
from .design import Goal as Goal, Limits as Limits, design as design
from .motion import PlannedMotion as PlannedMotion
from .noise_level import noise_named as noise_named
from .pilot import pilot_of as pilot_of
from .plan import Plan as Plan, make_plan as make_plan
from .precision import precision as precision
from .profile import Profile as Profile
from .proposals import proposed_profiles as proposed_profiles
from .servo import Servo as Servo
from .setting import PlannedArm as PlannedArm, Setting as Setting
from .shape_table import SHAPES as SHAPES
from .wish import Wish as Wish
