from .copies import check_copies as check_copies
from .gate import refuse_stops as refuse_stops
