"""Operational modal analysis: modes from responses alone, while the structure works and no force is known."""
