"""Interoperation with other tools: output to their objects, and replacements of their functions."""
