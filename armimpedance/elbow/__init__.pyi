from .emg.imcj import (
    ImcjCalibration as ImcjCalibration,
    calibrate_imcj as calibrate_imcj,
    imcj as imcj,
)
from .emg.law import fit_emg_law_of as fit_emg_law_of, fit_law as fit_law
from .emg.law_result import EmgLaw as EmgLaw, LinearLaw as LinearLaw
from .frequency_response import (
    frequency_response as frequency_response,
    model_compliance as model_compliance,
)
from .result import (
    NAMES as NAMES,
    ChannelSnr as ChannelSnr,
    ElbowFit as ElbowFit,
    VaryingImpedance as VaryingImpedance,
)
from .samples import JointSamples as JointSamples, from_recording as from_recording
from .stationary.arx import solve_structure as solve_structure
from .stationary.band import band_of as band_of
from .stationary.estimate import Estimate as Estimate
from .stationary.identify import identify_elbow as identify_elbow
from .stationary.instruments import weighed_band as weighed_band
from .stationary.methods import DEFAULT as DEFAULT, METHODS as METHODS, method_named as method_named
from .stationary.preparation import Prepared as Prepared, prepare as prepare
from .stationary.whiteness import probability as probability
from .varying.identify import identify_varying as identify_varying
from .varying.methods import (
    VARYING_METHODS as VARYING_METHODS,
    varying_method_named as varying_method_named,
)
from .varying.windows import CONSTANT_S as CONSTANT_S
