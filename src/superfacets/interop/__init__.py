"""Interoperation with other tools: results on their objects, and functions under their names."""
