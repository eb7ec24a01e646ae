"""What tests of the check share: the properties that hold to rounding, and a made-up study of the order."""

from types import SimpleNamespace

import numpy as np

from daebench.diagnostics.order import fit_order

EXACT = ("symmetric", "symplectic", "keeps g", "keeps G H_p", "keeps H")


class Study:
    """What :func:`daebench.studies.orders.study.study` might give: errors of q and p against h."""

    def __init__(self, **errors):
        h = 0.1 * 0.5 ** np.arange(5)
        self.series = [SimpleNamespace(component=name, fit=fit_order(h, error(h))) for name, error in errors.items()]
