from .gate import refuse_stops as refuse_stops
