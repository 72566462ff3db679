"""Other engines on the same scenes, for the comparison only: each against its own converged answer."""
