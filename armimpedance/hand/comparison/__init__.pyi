from .differences import changes as changes
from .discrimination import (
    Discrimination as Discrimination,
    PeopleGroup as PeopleGroup,
    discriminate_groups as discriminate_groups,
)
from .groups import ComparedGroup as ComparedGroup, groups_of_recording as groups_of_recording
from .parametric import parametric_test as parametric_test
from .permutation import permutation_test as permutation_test
from .subjects import random_effects as random_effects
