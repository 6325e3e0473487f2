"""The report of joints identified on their own."""
