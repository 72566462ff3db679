"""What a user asks of scenarios: one run, its comparison with an experiment, many runs."""
