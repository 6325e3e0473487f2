"""What a test that was done would have been promised."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.measured.channel import Channel
from identify.planning.after_test import AfterTest
from identify.planning.candidates import Candidates
from identify.planning.known import Known
from identify.results.discovery import fit_of


def own_test(known: Known, fit: Path) -> np.ndarray:
    """Standard deviations of the free parameters on their search scale, from the test of a fit alone; known:
    what serves to promise them.
    """
    done = [one for one in fit_of(fit).measurements.values() if one.use == "fit"]
    frfs = [one.frf for one in done if one.frf is not None]
    hit = dict.fromkeys((Channel.parse(text).node, Channel.parse(text).axis) for text in frfs[0].input)
    seen = dict.fromkeys(Channel.parse(text).node for text in frfs[0].output)
    among = Candidates(np.deg2rad([one.posture_deg for one in done]), tuple(hit), tuple(seen))
    after = AfterTest(known, [known.free_model], among, known.bounds, known.bounds, True)
    chosen = tuple(np.arange(len(some)) for some in (among.postures, hit, seen))
    covariance = np.linalg.inv(after.precision((chosen[0], chosen[1], chosen[2])))
    return np.asarray(np.sqrt(np.diag(covariance))[: len(known.names)])
