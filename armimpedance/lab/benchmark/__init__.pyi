from .asked import Asked as Asked, Group as Group, Known as Known
from .folder import BenchmarkFolder as BenchmarkFolder
from .layout import (
    MARK as MARK,
    TOP as TOP,
    VERSION as VERSION,
    record_folder as record_folder,
    record_names as record_names,
)
from .scores_file import Scores as Scores, score_submission as score_submission
from .sealing import Key as Key, seed_of as seed_of
from .table import described as described, table_text as table_text
from .written import (
    keep_truth as keep_truth,
    kept_truth as kept_truth,
    write_index as write_index,
    write_task as write_task,
)
