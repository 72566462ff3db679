"""Smoothed particle hydrodynamics in the plane: smoothing functions, neighbour search, interpolation and gradients.

`functions.py` knows the smoothing functions (one file each), `cells.py` finds neighbours, `fields.py` holds the
compiled sums (Eqs 1 and 2), `fields.py` is what users call: arrays in, arrays out.
"""
