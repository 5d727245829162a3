from .calibrate import calibrate_sites as calibrate_sites
from .joint_motion import joint_motion as joint_motion
from .moving import motion_of as motion_of
