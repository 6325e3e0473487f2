"""What may be missing from a study of motion, found without a list of candidates: a catalogue of everything
that the simulator has, all at zero, what each would gain to first order, and refits of those that promise
most.
"""
