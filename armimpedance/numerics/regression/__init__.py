"""The regression core: one linear model for every analysis, with honest covariance.

`factors` reduces each trial to a small triangle; `solve.fit` turns triangles into a `result.Fit`;
`covariance`, `resample` and `diagnose` work on the triangles and touch no sample again, the
covariance of autocorrelated residuals aside.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
