"""The report of a fit of vibration."""
