"""What may explain a motor torque, a deflection or a tracking error: one small file per kind."""
