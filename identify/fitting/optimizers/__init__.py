"""Optimizers: they search scaled parameters for the least cost, one small file per kind; the registry of them
is in `base`.
"""
