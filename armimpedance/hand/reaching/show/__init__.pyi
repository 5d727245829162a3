from .methods_text import (
    NAGAR as NAGAR,
    is_moving as is_moving,
    moving_sentences as moving_sentences,
)
from .plan_text import movement_plan_text as movement_plan_text
from .verb import movement as movement, plan_movement as plan_movement
