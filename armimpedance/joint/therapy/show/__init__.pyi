from .contributions import Contributions as Contributions
from .models_json import (
    read_arm as read_arm,
    read_robot as read_robot,
    write_arm as write_arm,
    write_robot as write_robot,
)
from .plots import (
    plot_feedback as plot_feedback,
    plot_friction as plot_friction,
    plot_passive_arm as plot_passive_arm,
    plot_robot_calibration as plot_robot_calibration,
)
from .verb import (
    calibrate_arm as calibrate_arm,
    calibrate_robot as calibrate_robot,
    check_mockup as check_mockup,
    contribution as contribution,
)
