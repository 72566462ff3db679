"""How fast it is: measurements of speed and memory, run on demand (`blocksim bench`), and other engines beside it."""
