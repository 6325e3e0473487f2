"""What a fitted model says of cutting: depth limits and deflections of the tool, with their intervals."""
