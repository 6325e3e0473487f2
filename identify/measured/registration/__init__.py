"""The geometry of a test, in the frame of the analyser, laid on the robot: which link each node is on, and
where.
"""
