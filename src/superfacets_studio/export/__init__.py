"""Export labels, objects and regions to files."""
