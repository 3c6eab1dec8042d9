"""Stage 2: arc weights from creases, parts of the shape and features."""
