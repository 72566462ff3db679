"""Runs and sweeps as one self-contained HTML file."""
