"""Everything that may be missing in the model from the start, at amplitude zero; one penalised fit finds
which is not.
"""
