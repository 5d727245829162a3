from .emg_gate import (
    DEFAULT_LIMIT_PERCENT as DEFAULT_LIMIT_PERCENT,
    ENVELOPE_HZ as ENVELOPE_HZ,
    WINDOW_S as WINDOW_S,
    EmgLevel as EmgLevel,
    emg_gate as emg_gate,
    recorded_emg as recorded_emg,
)
from .from_motion import DEFAULT_CUTOFF_HZ as DEFAULT_CUTOFF_HZ, from_motion as from_motion
from .from_recording import from_joint_recording as from_joint_recording
from .identify import identify_passive as identify_passive
from .methods import (
    DEFAULT_METHOD as DEFAULT_METHOD,
    METHODS as METHODS,
    method_named as method_named,
)
from .result import PassiveFit as PassiveFit, summarise as summarise
from .samples import PassiveSamples as PassiveSamples
from .terms import RestAngle as RestAngle
