from .csv_trials import column_name as column_name, write_trial_files as write_trial_files
from .kinarm_archive import write_kinarm_archive as write_kinarm_archive
from .kinarm_exam import write_kinarm_c3d as write_kinarm_c3d
from .mapping_text import mapping_text as mapping_text, numeric_facts as numeric_facts
from .matlab_trials import (
    frame_column as frame_column,
    write_frames as write_frames,
    write_matlab_trials as write_matlab_trials,
)
from .mcap_log import write_mcap as write_mcap
from .motion_tables import write_mot_files as write_mot_files, write_trc_files as write_trc_files
from .parquet_table import write_parquet_table as write_parquet_table
