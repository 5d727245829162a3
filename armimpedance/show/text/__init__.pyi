from .numbers import (
    TABLE_WIDTH as TABLE_WIDTH,
    aligned_table as aligned_table,
    checks_lines as checks_lines,
    counted as counted,
    note_numbers as note_numbers,
    numbered_notes as numbered_notes,
    parameter_table as parameter_table,
    short as short,
    table_by_condition as table_by_condition,
)
from .recording_text import describe as describe, moves_a_robot as moves_a_robot
