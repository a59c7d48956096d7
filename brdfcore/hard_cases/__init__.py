"""Hard cases of the models: where an equation, typed in as printed, breaks, and how exact the library is there.

`catalogue(model)` lists them, `check(model)` evaluates them against mpmath; `brdf check --hard-cases` prints that.
"""

from .catalogue import HardCase, Point, catalogue, covering
from .report import CaseReport, ModelReport, check

__all__ = ["CaseReport", "HardCase", "ModelReport", "Point", "catalogue", "check", "covering"]
