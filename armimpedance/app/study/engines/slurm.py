"""SLURM: workers of Dask as its jobs, or an array of jobs that need no daemon."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from armimpedance.app.study.engines.dask import Dask
from armimpedance.app.study.engines.engine import Asked, Given, Work
from armimpedance.core.errors import InputError, needed

#: As SLURM takes them: minutes, minutes:seconds, hours:minutes:seconds, days-hours and so on;
#: a number of megabytes, or of another unit.
_TIME: Final = re.compile(r"([0-9]+-)?[0-9]+(:[0-9]+){0,2}")
_MEMORY: Final = re.compile(r"([0-9]+)([KMGTkmgt]?)[Bb]?")


@dataclass(frozen=True)
class SlurmJobs:
    """An engine: a scheduler of Dask here, whose workers are jobs of SLURM.

    What a job asks for (partition, account, time) stands in Dask's own configuration,
    ``~/.config/dask/jobqueue.yaml``, as for any other use of dask-jobqueue.

    Attributes
    ----------
    jobs : int
    memory : str
        Of each job, such as ``4GB``.
    """

    jobs: int
    memory: str = "4GB"

    def __call__(self, work: Work[Asked, Given], tasks: Iterable[Asked]) -> Iterator[Given]:
        """Outcomes as they come, in any order."""
        needed("dask_jobqueue", "cluster", "jobs of SLURM")
        from dask_jobqueue import SLURMCluster

        prologue = ["export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1"]
        with SLURMCluster(
            cores=1, processes=1, memory=self.memory, job_script_prologue=prologue
        ) as cluster:
            cluster.scale(jobs=self.jobs)
            yield from Dask(cluster.scheduler_address)(work, tasks)


def array_script(
    words: Sequence[str], options: Sequence[str], jobs: int, time: str, memory: str
) -> str:
    """A job array's script: one job a share of the sessions, then one for the group.

    Parameters
    ----------
    words : sequence of str
        The call of ``study`` up to its level: program, data, folder.
    options : sequence of str
        That both levels take.
    jobs : int
    time, memory : str
        What each job asks SLURM for.

    Returns
    -------
    str

    Raises
    ------
    InputError
        No time or memory as SLURM takes them.
    """
    time, memory = _time(time), _memory(memory)
    share = shlex.join([*words, "participant", *options])
    group = shlex.join([*words, "group", *options])
    return f"""#!/bin/bash
# Submit with: sbatch THIS_FILE
# Each job of the array works on its share of the sessions; what is done already is not done again.
# When all have ended, whether well or not, the group's job gathers their tables.
#SBATCH --job-name=study
#SBATCH --array=0-{jobs - 1}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --time={time}
#SBATCH --mem={memory}
#SBATCH --output=study-%A_%a.out

if [ "$SLURM_ARRAY_TASK_ID" = "{jobs - 1}" ]; then
  sbatch --job-name=study-group --dependency="afterany:$SLURM_ARRAY_JOB_ID" \\
    --time={time} --mem={memory} --wrap {shlex.quote(group)}
fi
{share} --workers 1 --task-index "$SLURM_ARRAY_TASK_ID" --tasks {jobs}
"""


def _time(word: str) -> str:
    """A time, and nothing that would be another line of a script."""
    if not _TIME.fullmatch(word):
        raise InputError(f"--time {word}", expected="minutes, hours:minutes:seconds or days-hours")
    return word


def _memory(word: str) -> str:
    """A number with the letter of its unit, and nothing else."""
    parts = _MEMORY.fullmatch(word)
    if parts is None:
        raise InputError(f"--memory {word}", expected="such as 4G, 4GB or 4000M")
    return f"{parts[1]}{parts[2] or 'M'}"
