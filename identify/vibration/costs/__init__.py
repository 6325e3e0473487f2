"""Costs: how far a model is from the data, one small file per kind; the registry of them is in `base`."""
