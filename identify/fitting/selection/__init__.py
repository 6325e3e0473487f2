"""The one loop that adds effects to a model, whatever the data: candidates, first looks, refits, evidence,
choice, rivals, pruning, exchange.
"""
