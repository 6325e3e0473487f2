"""Reports of a run, from its result file alone: one HTML page that needs no network, and one PDF, with the
same numbers.
"""
