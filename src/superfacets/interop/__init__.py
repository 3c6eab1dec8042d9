"""Interoperation with other tools: results on their objects, and drop-in functions for them."""
