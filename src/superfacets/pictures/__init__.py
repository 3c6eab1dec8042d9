"""Stage 7: colors of regions, pictures, and HTML pages."""
