from .copies import check_copies as check_copies
from .course import (
    HAND_WORDS as HAND_WORDS,
    SessionWords as SessionWords,
    TrialsChange as TrialsChange,
    change_over_trials as change_over_trials,
    check_inertia_over as check_inertia_over,
    clearest_finding as clearest_finding,
    sizes_beside as sizes_beside,
)
from .gate import refuse_stops as refuse_stops
from .joint_size import (
    check_hand_size as check_hand_size,
    check_joint_size as check_joint_size,
    refuse_joint_size as refuse_joint_size,
    refuse_size as refuse_size,
)
