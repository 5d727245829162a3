from .differentiate import (
    SPLINE_DEGREE as SPLINE_DEGREE,
    Kernels as Kernels,
    derivatives as derivatives,
    smoothed_derivatives as smoothed_derivatives,
    spline_kernels as spline_kernels,
)
from .emg.activation import (
    envelope as envelope,
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
from .emg.silence import EmgLevel as EmgLevel, emg_gate as emg_gate, recorded_emg as recorded_emg
from .filters import (
    LastRows as LastRows,
    bandpass as bandpass,
    causal_lowpass as causal_lowpass,
    filtered_sign as filtered_sign,
    lowpass as lowpass,
    lowpass_delay_s as lowpass_delay_s,
)
from .modes import (
    Modes as Modes,
    delayed as delayed,
    position_noise as position_noise,
    spline_modes as spline_modes,
)
from .response import (
    choose_span as choose_span,
    correct_force_only as correct_force_only,
    ramp_basis as ramp_basis,
    respond as respond,
)
from .sample_faults import beyond_the_others as beyond_the_others, refuse_degrees as refuse_degrees
from .spectra import multiple_coherence as multiple_coherence
from .validity import (
    FEWEST_AT_REST as FEWEST_AT_REST,
    check_recording as check_recording,
    rms_at_rest as rms_at_rest,
)
from .windows import (
    MARGIN_S as MARGIN_S,
    cut_windows as cut_windows,
    disturbance_times as disturbance_times,
)
