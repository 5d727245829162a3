from .content import (
    About as About,
    Cells as Cells,
    Content as Content,
    Quantity as Quantity,
    in_one_cell as in_one_cell,
    of_one_cell as of_one_cell,
    shared_steps as shared_steps,
)
from .endings import ENDINGS as ENDINGS
from .fit_json import read_parameter as read_parameter
from .matlab import course_struct as course_struct
from .table_row import (
    TableRow as TableRow,
    read_left_out as read_left_out,
    table_rows as table_rows,
)
from .tables import (
    table_content as table_content,
    write_content as write_content,
    write_json as write_json,
)
from .words import (
    IMPEDANCE_COLUMNS as IMPEDANCE_COLUMNS,
    QUALITY_COLUMNS as QUALITY_COLUMNS,
    meaning_of as meaning_of,
    number as number,
    quantities_of as quantities_of,
)
from .written import FittedResult as FittedResult, WrittenResult as WrittenResult
