"""Many jobs on one machine or a cluster: what a batch asks for, the workers, the loop that survives faults,
the index, the summary.
"""

from identify.core.called import called

called(__name__)
