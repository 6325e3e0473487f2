"""The report of results side by side."""
