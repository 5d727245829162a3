from .findings_text import checks_lines as checks_lines
from .html_table import html_table as html_table
from .numbers import (
    TABLE_WIDTH as TABLE_WIDTH,
    aligned_table as aligned_table,
    counted as counted,
    fixed as fixed,
    note_numbers as note_numbers,
    numbered_notes as numbered_notes,
    percent as percent,
    short as short,
    table_by_condition as table_by_condition,
    with_half_width as with_half_width,
    with_interval as with_interval,
)
from .parameter_table import parameter_table as parameter_table
from .recording_text import describe as describe, moves_a_robot as moves_a_robot
