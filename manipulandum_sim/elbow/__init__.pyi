from .bench import Departures as Departures, simulate_bench as simulate_bench
from .cascade import (
    CascadeTruth as CascadeTruth,
    Reflex as Reflex,
    simulate_cascade as simulate_cascade,
)
from .device import RATE_HZ as RATE_HZ
from .emg import Electrodes as Electrodes, raw_emg as raw_emg
from .plant import (
    HIDING_GAIN as HIDING_GAIN,
    HIDING_HZ as HIDING_HZ,
    KINEMATICS_HZ as KINEMATICS_HZ,
)
from .protocol import LOADS as LOADS, RHYTHM_HZ as RHYTHM_HZ
from .servo import simulate_servo as simulate_servo
from .simulate import simulate_elbow as simulate_elbow
from .truth import ElbowTruth as ElbowTruth
