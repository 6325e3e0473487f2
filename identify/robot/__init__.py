"""The robot: its description (URDF or Denavit-Hartenberg table), its posture, and the one file that knows the
dynamics engine.
"""
