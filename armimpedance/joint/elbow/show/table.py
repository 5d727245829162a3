"""COURSE.csv: B and K of one joint over time, with their 95 % bands; I beside them."""

from __future__ import annotations

from armimpedance.joint.elbow.elbow_result import VaryingImpedance
from armimpedance.show.files import About, Content, course_struct, table_content


def varying_content(varying: VaryingImpedance) -> Content:
    """What a file holds of a course, its numbers to ten digits."""
    table = varying.to_frame()
    rows = [{str(name): c for name, c in row.items()} for row in table.to_dict("records")]
    columns = list(table.columns)
    about = About(checks=tuple(varying.checks))
    keys = ("trial", varying.over, "method")
    return table_content(
        rows,
        columns,
        keys=keys,
        structs=lambda: [course_struct(columns, rows)],
        about=about,
        digits=10,
    )
