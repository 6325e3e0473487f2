"""Tests of what takes a fitted model to other programs."""
