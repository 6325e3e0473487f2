"""Tests of studies of vibration."""
