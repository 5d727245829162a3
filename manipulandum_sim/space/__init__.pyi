from .arm import SpaceArm as SpaceArm
from .conditions import SpaceCondition as SpaceCondition
from .directions import sphere_directions as sphere_directions
from .moment_arms import write_moment_arms as write_moment_arms
from .plant import Plant as Plant, plant_at as plant_at
from .rig import SPACE_NOISE as SPACE_NOISE, SpaceRig as SpaceRig
from .simulate import simulate_space as simulate_space
from .truth import SpaceTruth as SpaceTruth, find_space_truth as find_space_truth
