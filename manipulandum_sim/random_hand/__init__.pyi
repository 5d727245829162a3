from .commands import tremor_filter as tremor_filter
from .joint_rig import JointRig as JointRig
from .joints import find_joint as find_joint
from .rig import RandomRig as RandomRig
from .simulate import simulate_random as simulate_random
from .simulate_joint import simulate_random_joint as simulate_random_joint
from .truth import RandomTruth as RandomTruth
