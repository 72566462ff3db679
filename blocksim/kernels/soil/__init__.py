"""Soil as an elasto-plastic body of SPH particles, in plane strain: a system in the steps of the explicit scheme.

`arrays.py` has all arrays, `neighbours.py` cells and lists, `stress.py` the constitutive law, `contact.py` what
particles and bodies do to one another, `step.py` the stages of a step with velocity gradients and forces between
particles, and what soil holds.
"""
