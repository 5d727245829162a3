from .check import check_pushes as check_pushes
from .identify import identify_movement as identify_movement
from .plan import MovementPlan as MovementPlan, plan_movement as plan_movement
from .table import METHODS as METHODS
