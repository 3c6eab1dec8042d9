"""Stage 5: clean-up, hierarchies and borders of regions, and transfer of labels."""
