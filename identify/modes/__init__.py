"""`identify modes`: the modes of measured FRFs from the data to the result."""
