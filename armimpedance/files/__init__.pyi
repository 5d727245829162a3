from .comparison_csv import comparison_rows as comparison_rows
from .fit_json import (
    read_parameter as read_parameter,
    write_fit as write_fit,
    write_json as write_json,
)
from .joint_rows_csv import read_joint_rows as read_joint_rows
from .left_out_csv import read_left_out as read_left_out
from .model_json import read_model as read_model, write_model as write_model
from .muscle_csv import (
    muscle_rows as muscle_rows,
    write_muscle_results as write_muscle_results,
)
from .prediction_csv import (
    joined as joined,
    read_activations as read_activations,
    read_postures as read_postures,
    write_predictions as write_predictions,
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
    result_rows as result_rows,
    write_results as write_results,
)
from .results_json import result_objects as result_objects
from .tables import write_table as write_table
from .therapy_csv import (
    write_contributions as write_contributions,
    write_samples as write_samples,
)
from .therapy_json import (
    read_arm as read_arm,
    read_robot as read_robot,
    write_arm as write_arm,
    write_robot as write_robot,
)
from .varying_csv import write_varying as write_varying
