"""Verification: cases with closed-form or accepted results, run on demand (`blocksim verify`) and as tests."""
