"""The report of a map over postures."""
