"""File formats of results; one file each."""
