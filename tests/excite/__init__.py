"""Tests of motion that excites."""
