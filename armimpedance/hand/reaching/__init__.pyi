from .check import check_pushes as check_pushes
from .identify import identify_movement as identify_movement
from .identify_course import identify_course as identify_course
from .methods import METHODS as METHODS
