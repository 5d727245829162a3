from .copies import check_copies as check_copies
from .course import change_over_trials as change_over_trials
from .gate import refuse_stops as refuse_stops
from .joint_size import check_joint_size as check_joint_size
