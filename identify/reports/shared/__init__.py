"""What reports of several kinds share: FRFs and modes of measurements, parameters, the robot, postures."""
