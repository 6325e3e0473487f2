"""Tests of identify.map."""
