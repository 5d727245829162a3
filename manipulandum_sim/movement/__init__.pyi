from .path import Variability as Variability
from .pushes import PUSHES as PUSHES, Push as Push
from .rig import DEVICES as DEVICES, MovementRig as MovementRig
from .simulate import simulate_movement as simulate_movement
from .truth import MovementTruth as MovementTruth, find_truth as find_truth
