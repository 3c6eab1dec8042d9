"""Writers: a file per format, each for cells, labels or regions."""
