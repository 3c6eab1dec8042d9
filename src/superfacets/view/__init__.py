"""Stage 7: colors and pictures."""
