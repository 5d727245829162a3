from .allowed import check_steps as check_steps
from .cohort import run_group as run_group
from .design import (
    StudyDesign as StudyDesign,
    read_design as read_design,
)
from .discrimination import discriminate as discriminate
from .engines.dask import Dask as Dask
from .engines.engine import Engine as Engine
from .engines.processes import Processes as Processes
from .engines.slurm import SlurmJobs as SlurmJobs, array_script as array_script
from .participants import (
    STORE as STORE,
    StudyLog as StudyLog,
    run_participants as run_participants,
    unknown_sessions as unknown_sessions,
)
from .sessions import (
    StudySession as StudySession,
    chosen as chosen,
    find_sessions as find_sessions,
    share_of as share_of,
)
