"""Complex mode indicator function: singular values of the FRF matrix at every line (Shih, Tsuei, Allemang and
Brown, MSSP 2 (1988)).
"""

from __future__ import annotations

import numpy as np

from identify.modal.layout import Layout


def cmif(layout: Layout) -> np.ndarray:
    """(lines, references), largest first, of the responses measured against every reference; unit of the
    FRFs.

    A peak of the first is a mode; a peak of the second at the same line is another one that close.
    """
    return np.asarray(np.linalg.svd(layout.frf[:, layout.complete], compute_uv=False))
