"""Fitting inputs of a scenario to measured repeats, so that agreement is probable and not lucky."""
