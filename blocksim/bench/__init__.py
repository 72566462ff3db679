"""Measurements of speed and memory, run on demand (`blocksim bench`), also of other engines."""
