from .commands import tremor_filter as tremor_filter
from .rig import RandomRig as RandomRig
from .simulate import simulate_random as simulate_random
from .truth import RandomTruth as RandomTruth
