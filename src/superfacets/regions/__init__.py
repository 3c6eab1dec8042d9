"""Stage 5: clean up and merge regions, extract their borders, and transfer labels."""
