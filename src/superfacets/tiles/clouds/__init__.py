"""Point clouds in tiles."""
