from .design import Design as Design, check_steps as check_steps, read_design as read_design
from .engines.processes import Processes as Processes
from .group import Gathered as Gathered, run_group as run_group
from .participants import (
    run_participants as run_participants,
    unknown_sessions as unknown_sessions,
)
from .sessions import Session as Session, chosen as chosen, find_sessions as find_sessions
