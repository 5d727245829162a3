from .causal import causal_lowpass as causal_lowpass, lowpass_delay_s as lowpass_delay_s
from .differentiate import (
    SPLINE_DEGREE as SPLINE_DEGREE,
    Kernels as Kernels,
    derivatives as derivatives,
    spline_kernels as spline_kernels,
)
from .drift import correct_force_only as correct_force_only, ramp_basis as ramp_basis
from .emg.activation import (
    mean_activation as mean_activation,
    mvc_column as mvc_column,
    rest_column as rest_column,
    without_rest as without_rest,
)
from .emg.amplitude import (
    CUTOFF_HZ as CUTOFF_HZ,
    emg_amplitude as emg_amplitude,
    segment_amplitude as segment_amplitude,
)
from .emg.checks import check_emg as check_emg
from .emg.emg import envelope as envelope
from .emg.silence import EmgLevel as EmgLevel, emg_gate as emg_gate, recorded_emg as recorded_emg
from .encoder import position_noise as position_noise
from .filtered_sign import filtered_sign as filtered_sign
from .filters import bandpass as bandpass, lowpass as lowpass
from .last_rows import LastRows as LastRows
from .modes import Modes as Modes, delayed as delayed, spline_modes as spline_modes
from .radians import refuse_degrees as refuse_degrees
from .response import choose_span as choose_span, respond as respond
from .spectra import multiple_coherence as multiple_coherence
from .spline_derivatives import smoothed_derivatives as smoothed_derivatives
from .strays import beyond_the_others as beyond_the_others
from .validity import check_recording as check_recording
from .windows import (
    MARGIN_S as MARGIN_S,
    cut_windows as cut_windows,
    disturbance_times as disturbance_times,
)
