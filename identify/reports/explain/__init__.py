"""The report of explained motion."""
