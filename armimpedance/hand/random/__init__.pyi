from .identify import identify_random as identify_random
from .lines import lines_of as lines_of
