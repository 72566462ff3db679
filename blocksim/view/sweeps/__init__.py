"""Pictures of sweeps. A new kind is one module, and one line in `kinds`."""
