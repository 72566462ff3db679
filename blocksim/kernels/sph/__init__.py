"""Smoothed particle hydrodynamics in the plane: smoothing functions, neighbour search, interpolation and gradients.

`functions.py` has the smoothing functions, `fields.py` finds neighbours and holds the compiled sums (Eqs 1 and 2) and
what users call: arrays in, arrays out.
"""
