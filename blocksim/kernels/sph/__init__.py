"""Smoothed particle hydrodynamics in the plane: smoothing functions."""
