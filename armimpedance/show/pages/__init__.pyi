from .asked import NAMED as NAMED, Asked as Asked
from .build import page_from as page_from, reviewed as reviewed
from .many import Fold as Fold, Folds as Folds, Heat as Heat, Mark as Mark, Row as Row
from .methods_text import COVARIANCES as COVARIANCES, methods_of as methods_of, software as software
from .of_fit import fit_page as fit_page, parameter_table as parameter_table, told_by as told_by
from .page import (
    Block as Block,
    Linked as Linked,
    Methods as Methods,
    Page as Page,
    Picture as Picture,
    Printed as Printed,
    Prose as Prose,
    Section as Section,
    State as State,
    Table as Table,
    Verdict as Verdict,
)
from .pictures import picture as picture
from .references import (
    GUIDALI as GUIDALI,
    RUIZ as RUIZ,
    TSUJI as TSUJI,
    VENTURE_BODY as VENTURE_BODY,
    VENTURE_ELBOW as VENTURE_ELBOW,
)
from .rendering import write_html as write_html, write_page as write_page
from .topic import TOPICS as TOPICS, Topic as Topic
