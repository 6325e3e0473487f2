"""The report of an exciting motion: what to run, and what it promises."""
