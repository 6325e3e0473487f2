"""Motion in the time domain: drives, servo loops, simulation; measured records and what explains them."""
