"""Modes of a structure that was measured in several setups, whose poles differ by what sensors weigh."""
