"""A fitted model over postures: frequencies, damping and tool FRFs with their intervals."""
