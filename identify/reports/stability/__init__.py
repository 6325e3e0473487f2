"""The report of depth limits of a cut."""
