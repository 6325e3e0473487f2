"""Measured data: channels, FRF sets, modal tables, time histories; loaders, estimators and quality checks."""
