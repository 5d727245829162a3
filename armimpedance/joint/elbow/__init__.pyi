from .cascade.identify import identify_cascade as identify_cascade
from .cascade.methods import CASCADE_METHODS as CASCADE_METHODS
from .elbow_result import ElbowFit as ElbowFit, VaryingImpedance as VaryingImpedance
from .emg.imcj import calibrate_imcj as calibrate_imcj, imcj as imcj
from .emg.law import fit_emg_law_of as fit_emg_law_of, fit_law as fit_law
from .emg.law_result import EmgLaw as EmgLaw, LinearLaw as LinearLaw
from .samples import JointSamples as JointSamples, from_recording as from_recording
from .stationary.identify import (
    estimate_joint as estimate_joint,
    identify_elbow as identify_elbow,
    least_squares_arx as least_squares_arx,
)
from .stationary.methods import METHODS as METHODS
from .varying.identify import identify_varying as identify_varying
from .varying.methods import VARYING_METHODS as VARYING_METHODS
