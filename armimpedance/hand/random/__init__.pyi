from .doubts import check_wrist as check_wrist
from .identify import identify_random as identify_random
from .lines import lines_of as lines_of
