from .comparison_csv import comparison_content as comparison_content
from .fit_json import (
    fit_content as fit_content,
    read_parameter as read_parameter,
)
from .joint_rows_csv import read_joint_rows as read_joint_rows
from .left_out_csv import read_left_out as read_left_out
from .model_json import read_model as read_model, write_model as write_model
from .muscle_csv import muscles_content as muscles_content
from .prediction_csv import (
    joined as joined,
    predictions_content as predictions_content,
    read_activations as read_activations,
    read_postures as read_postures,
)
from .quantities import (
    antisymmetric as antisymmetric,
    condition_of as condition_of,
    ellipse_values as ellipse_values,
    half_widths as half_widths,
    is_recording_of_joints as is_recording_of_joints,
    principal_values as principal_values,
)
from .result_row import check_group_columns as check_group_columns
from .results_csv import (
    read_results as read_results,
    results_content as results_content,
    write_results as write_results,
)
from .sentences import shared_steps as shared_steps
from .table_row import table_rows as table_rows
from .tables import (
    table_content as table_content,
    write_content as write_content,
)
from .therapy_csv import samples_content as samples_content
from .therapy_json import (
    read_arm as read_arm,
    read_robot as read_robot,
    write_arm as write_arm,
    write_robot as write_robot,
)
from .varying_csv import varying_content as varying_content
from .written.content import About as About, Content as Content
