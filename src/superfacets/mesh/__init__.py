"""Stage 0: what users bring, checked."""
