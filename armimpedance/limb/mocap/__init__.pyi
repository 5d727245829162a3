from .joint_motion import joint_motion as joint_motion, motion_of as motion_of
from .kinematics import calibrate_sites as calibrate_sites
