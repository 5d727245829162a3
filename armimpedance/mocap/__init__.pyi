from .calibrate import calibrate_sites as calibrate_sites
from .joint_motion import joint_motion as joint_motion
