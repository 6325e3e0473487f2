"""Tests of identify.machining."""
