"""Export of labels, objects and regions to files."""
