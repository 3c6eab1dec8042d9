"""A slow, readable twin of every kernel: the oracle of the tests."""
