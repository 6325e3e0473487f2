"""Kinds of mistakes, a file for each family."""
