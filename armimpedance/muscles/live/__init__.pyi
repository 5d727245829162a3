from .calibration import (
    CalibrationPlan as CalibrationPlan,
    CalibrationWish as CalibrationWish,
    plan_calibration as plan_calibration,
)
from .conditions import Workspace as Workspace, holdable as holdable
from .emg_levels import EmgLevels as EmgLevels
from .form import StiffnessForm as StiffnessForm
from .serve import serve as serve
from .show.command_plan import (
    add_live as add_live,
    plan_live as plan_live,
    refuse_own as refuse_own,
)
from .sources import packets_of as packets_of
from .updates import Live as Live
