"""The report of a modal analysis."""
