from .identify import identify_course as identify_course, identify_movement as identify_movement
from .methods import METHODS as METHODS
from .windows import check_pushes as check_pushes
