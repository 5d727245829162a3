from .ellipsoid import (
    Ellipsoid as Ellipsoid,
    ellipsoid_of as ellipsoid_of,
    ellipsoid_of_matrix as ellipsoid_of_matrix,
)
from .geometry import (
    FIELDS as FIELDS,
    Ellipse as Ellipse,
    NotPositiveDefiniteError as NotPositiveDefiniteError,
    Which as Which,
    ellipse as ellipse,
    ellipse_of as ellipse_of,
    half_turn as half_turn,
    locus as locus,
)
from .resampled import resampled_ellipse as resampled_ellipse
