"""The report of a simulated or fitted motion."""
