"""`identify modes`: the modes of measured FRFs from the data to the result."""

from identify.core.called import called

called(__name__)
