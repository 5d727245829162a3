from .fits import PassiveFits as PassiveFits
from .from_motion import from_motion as from_motion
from .from_recording import from_joint_recording as from_joint_recording
from .identify import identify_passive as identify_passive
from .methods import METHODS as METHODS
from .result import PassiveFit as PassiveFit
from .samples import PassiveSamples as PassiveSamples
