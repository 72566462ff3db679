"""Compiled loops over flat arrays: broad phase, narrow phase, contact laws, integration and the energy ledger."""
