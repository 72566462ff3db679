"""Which inputs decide where the blocks end, and how: sensitivity indices of run-outs and outcomes."""
