"""What both schemes and soil stand on: arrays, geometry, supports, loads, the barrier between threads."""
