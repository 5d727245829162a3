from .folder import (
    BenchmarkFolder as BenchmarkFolder,
    keep_truth as keep_truth,
    kept_truth as kept_truth,
    write_index as write_index,
    write_task as write_task,
)
from .layout import (
    MARK as MARK,
    TOP as TOP,
    VERSION as VERSION,
    AskedGroup as AskedGroup,
    AskedQuantity as AskedQuantity,
    Key as Key,
    KnownTruth as KnownTruth,
    record_folder as record_folder,
    record_names as record_names,
    seed_of as seed_of,
)
from .table import (
    Scores as Scores,
    described as described,
    score_submission as score_submission,
    table_text as table_text,
)
