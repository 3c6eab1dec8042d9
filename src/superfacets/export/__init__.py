"""Writers of cells, labels and regions, with one module per format."""
