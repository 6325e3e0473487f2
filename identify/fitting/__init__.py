"""The fit loop: starts, stages, the journal that makes runs resumable, and the uncertainty of what was
found.
"""
