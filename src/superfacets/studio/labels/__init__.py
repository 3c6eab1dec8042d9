"""Classes, objects and suggestions of cells, and the encoding of sets of cells."""
