from .fit_json import (
    fit_content as fit_content,
    read_parameter as read_parameter,
    write_json as write_json,
)
from .left_out_csv import read_left_out as read_left_out
from .sentences import (
    in_one_cell as in_one_cell,
    of_one_cell as of_one_cell,
    shared_steps as shared_steps,
)
from .table_row import TableRow as TableRow, table_rows as table_rows
from .tables import table_content as table_content, write_content as write_content
from .written.content import (
    About as About,
    Cells as Cells,
    Content as Content,
    Quantity as Quantity,
)
from .written.course import course_struct as course_struct
from .written.long import quantities_of as quantities_of
from .written.words import meaning_of as meaning_of
