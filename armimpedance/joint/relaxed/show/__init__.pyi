from .plot import (
    plot_emg_level as plot_emg_level,
    plot_passive_fit as plot_passive_fit,
    plot_passive_fits as plot_passive_fits,
)
from .verb import passive as passive
