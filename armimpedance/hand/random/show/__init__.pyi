from .verb import random as random
