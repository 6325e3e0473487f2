"""Stated uncertainty of a study of vibration: what is uncertain by how much, fitted along with the
parameters.
"""
