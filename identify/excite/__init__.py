"""Motion that tells the most of a robot, within its limits, and what it promises (`identify excite`)."""

from identify.core.called import called

called(__name__)
