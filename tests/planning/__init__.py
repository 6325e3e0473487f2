"""Tests of identify.planning."""
