"""The report of a plan: the sheet of the test."""
