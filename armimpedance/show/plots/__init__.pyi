from .captions import panel_letters as panel_letters, save_with_caption as save_with_caption
from .looks import MOST_LOOKS as MOST_LOOKS, look as look
from .room import NamesBeside as NamesBeside, RoomyLocator as RoomyLocator
from .rows import (
    DrawnRow as DrawnRow,
    Series as Series,
    TableBlock as TableBlock,
    draw_elements as draw_elements,
    draw_ellipses as draw_ellipses,
    name_rows as name_rows,
    plot_table as plot_table,
    row_axes as row_axes,
)
from .style import (
    LINE_STYLES as LINE_STYLES,
    MODEL_LINE_STYLE as MODEL_LINE_STYLE,
    OKABE_ITO as OKABE_ITO,
    ONE_COLUMN_IN as ONE_COLUMN_IN,
    TWO_COLUMNS_IN as TWO_COLUMNS_IN,
    drawn_for as drawn_for,
    element_text as element_text,
    label_axes as label_axes,
    new_axes as new_axes,
    new_figure as new_figure,
    print_style as print_style,
    save as save,
    unit_text as unit_text,
)
from .surfaces import (
    COLORS as COLORS,
    MeasuredPoints as MeasuredPoints,
    Surface as Surface,
    few_ticks as few_ticks,
    level_norm as level_norm,
    plot_surface as plot_surface,
    surface_levels as surface_levels,
)
