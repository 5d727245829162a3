from .emg_verb import emg_law as emg_law
from .over_time_verb import elbow_over_time as elbow_over_time
from .plot import (
    plot_emg_law as plot_emg_law,
    plot_frequency_response as plot_frequency_response,
    plot_varying as plot_varying,
    plot_varying_both as plot_varying_both,
)
from .text import elbow_text as elbow_text, law_text as law_text, varying_text as varying_text
from .verb import elbow as elbow
