"""The report of deflections."""
