"""Stage 5: connect, merge, smooth and resize regions: labels of cells in, labels out."""
