"""Standalone identification of joints: stiffness, friction, transmission error, base parameters; each from a
run of its own.
"""
