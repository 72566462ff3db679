"""Soil as an elasto-plastic body of SPH particles, in plane strain: a system in the steps of the explicit scheme.

`arrays.py` has all arrays, `neighbours.py` cells and lists, `step.py` velocity gradients, `stress.py` the
constitutive law, `step.py` forces between particles, `contact.py`, `contact.py` and `contact.py` what particles and
bodies do to one another, `step.py` the stages of a step, `energy.py` what soil holds.
"""
