from .text import next_text as next_text
from .verb import next_trials as next_trials
