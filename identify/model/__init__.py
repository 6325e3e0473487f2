"""The linearised model: assembly to M, C, K at a posture; FRFs, modes and their exact sensitivities as
functions on arrays.
"""
