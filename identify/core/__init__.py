"""What everything rests on: errors, the registry of plug points, config reading, parameters, whole files."""
