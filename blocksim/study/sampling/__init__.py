"""Which values the cases of a sweep have: one file a mode, and the distributions that values are drawn from."""
