from .copies import check_copies as check_copies
from .gate import refuse_stops as refuse_stops
from .joint_size import check_joint_size as check_joint_size
