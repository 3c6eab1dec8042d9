"""Stage 7: colors, pictures and pages."""
