"""Simulate collapses of rigid blocks and compare them with measurements."""

__version__ = "0.1.0"
