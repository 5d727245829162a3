from .asked import (
    NAMED as NAMED,
    Asked as Asked,
    Topic as Topic,
    gravest_first as gravest_first,
    page_from as page_from,
    reviewed as reviewed,
)
from .of_fit import (
    COVARIANCES as COVARIANCES,
    GUIDALI as GUIDALI,
    RUIZ as RUIZ,
    TSUJI as TSUJI,
    VENTURE_BODY as VENTURE_BODY,
    VENTURE_ELBOW as VENTURE_ELBOW,
    fit_page as fit_page,
    methods_of as methods_of,
    parameter_table as parameter_table,
    told_by as told_by,
)
from .page import (
    Block as Block,
    Fold as Fold,
    Folds as Folds,
    Heat as Heat,
    Linked as Linked,
    Mark as Mark,
    Methods as Methods,
    Page as Page,
    Picture as Picture,
    Printed as Printed,
    Prose as Prose,
    Row as Row,
    Section as Section,
    State as State,
    Table as Table,
    Verdict as Verdict,
)
from .pictures import picture as picture
from .rendering import write_html as write_html, write_page as write_page
from .topics import TOPICS as TOPICS
