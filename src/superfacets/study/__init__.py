"""Studies: other methods, the Princeton benchmark, and a reproduction of the paper's figures."""
