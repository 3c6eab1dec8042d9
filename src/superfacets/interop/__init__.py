"""Interoperation with other tools: storage in their objects, and replacements of functions."""
