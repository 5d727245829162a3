from .identify import identify_passive as identify_passive
from .linear import from_joint_recording as from_joint_recording
from .methods import METHODS as METHODS
from .passive_fit import PassiveFit as PassiveFit, PassiveFits as PassiveFits
from .samples import PassiveSamples as PassiveSamples, from_motion as from_motion
