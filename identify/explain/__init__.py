"""Recorded motion explained: effects behind motor torques, deflections and tracking errors, fitted on one
record, judged on another.
"""

from identify.core.called import called

called(__name__)
