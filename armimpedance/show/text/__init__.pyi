from .numbers import (
    TABLE_WIDTH as TABLE_WIDTH,
    aligned_table as aligned_table,
    checks_lines as checks_lines,
    counted as counted,
    fixed as fixed,
    html_table as html_table,
    note_numbers as note_numbers,
    numbered_notes as numbered_notes,
    parameter_table as parameter_table,
    percent as percent,
    short as short,
    table_by_condition as table_by_condition,
    with_half_width as with_half_width,
    with_interval as with_interval,
)
from .recording_text import describe as describe, moves_a_robot as moves_a_robot
