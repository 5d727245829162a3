"""The analyses as one calls them: a verb a topic, from a recording or its path to a result.

Commands and notebooks call the same verbs; the rooms below hold the equations.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
