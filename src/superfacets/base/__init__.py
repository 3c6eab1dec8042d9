"""Errors, types, timing, options, and checks of numbers, labels and arrays."""
