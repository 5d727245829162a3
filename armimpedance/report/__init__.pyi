from .body_text import body_text as body_text
from .comparison_text import comparison_text as comparison_text, subjects_text as subjects_text
from .contribution_text import contribution_text as contribution_text
from .discrimination_text import discrimination_text as discrimination_text
from .elbow_law_text import law_text as law_text
from .elbow_text import elbow_text as elbow_text, varying_text as varying_text
from .estimate_text import estimate_text as estimate_text
from .findings_text import checks_lines as checks_lines
from .methods_table import methods_table as methods_table
from .model_text import model_text as model_text
from .movement_plan_text import movement_plan_text as movement_plan_text
from .muscle_text import muscle_text as muscle_text
from .numbers import (
    TABLE_WIDTH as TABLE_WIDTH,
    aligned_table as aligned_table,
    counted as counted,
    fixed as fixed,
    with_half_width as with_half_width,
)
from .passive_text import passive_text as passive_text
from .plan_text import plan_text as plan_text
from .recording_text import describe as describe, moves_a_robot as moves_a_robot
from .reflex_text import (
    headline as headline,
    verdict_rows as verdict_rows,
    verdict_text as verdict_text,
)
from .text_table import summary_table as summary_table
from .therapy_text import (
    arm_text as arm_text,
    mockup_text as mockup_text,
    robot_text as robot_text,
)
