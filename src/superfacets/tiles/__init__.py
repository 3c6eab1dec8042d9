"""Meshes larger than memory: cells on disk, tile by tile along the space-filling curve."""
