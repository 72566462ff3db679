"""From a scenario to flat arrays: bodies, contact parameters, admissible step."""
