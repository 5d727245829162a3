from .plan_verb import plan_movement as plan_movement
from .text import (
    NAGAR as NAGAR,
    is_moving as is_moving,
    movement_plan_text as movement_plan_text,
    moving_sentences as moving_sentences,
)
from .verb import movement as movement
