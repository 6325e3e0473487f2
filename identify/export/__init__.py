"""A fitted model taken to other programs (`identify export`): matrices and state space, universal files,
MuJoCo, URDF, Simulink.
"""
