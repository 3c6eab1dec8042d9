"""Meshes larger than memory: cells in tiles on disk, along a space-filling curve."""
