"""Static limit analysis: what rigid blocks with dry friction can carry at all, by linear programmes."""
