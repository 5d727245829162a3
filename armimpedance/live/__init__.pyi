from .form import StiffnessForm as StiffnessForm
from .result import LiveStiffness as LiveStiffness
from .streams import lines_of as lines_of, serve as serve
from .updates import Live as Live
