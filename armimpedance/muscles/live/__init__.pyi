from .calibration import (
    CalibrationPlan as CalibrationPlan,
    CalibrationWish as CalibrationWish,
    Workspace as Workspace,
    holdable as holdable,
    plan_calibration as plan_calibration,
)
from .hand_stiffness import StiffnessForm as StiffnessForm
from .inputs import EmgLevels as EmgLevels
from .show.command_plan import (
    add_live as add_live,
    plan_live as plan_live,
    refuse_own as refuse_own,
)
from .stream import packets_of as packets_of, serve as serve
from .updates import Live as Live
