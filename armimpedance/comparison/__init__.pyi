from .compare import compare as compare
from .differences import changes as changes
from .discrimination import (
    Discrimination as Discrimination,
    Group as Group,
    discriminate_groups as discriminate_groups,
)
from .groups import (
    ComparedGroup as ComparedGroup,
    groups_of_estimates as groups_of_estimates,
    groups_of_recording as groups_of_recording,
    name_of as name_of,
)
from .inertia import check_inertia as check_inertia
from .pairs import Pair as Pair
from .parametric import parametric_test as parametric_test
from .permutation import permutation_test as permutation_test
from .subjects import (
    SubjectsChange as SubjectsChange,
    compare_subjects as compare_subjects,
    random_effects as random_effects,
)
