from .check import check_pushes as check_pushes
from .identify import identify_movement as identify_movement
from .table import METHODS as METHODS
