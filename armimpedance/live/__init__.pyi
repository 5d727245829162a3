from .emg_levels import EmgLevels as EmgLevels
from .form import StiffnessForm as StiffnessForm
from .result import LiveStiffness as LiveStiffness
from .serve import serve as serve
from .sources import packets_of as packets_of
from .updates import Live as Live
