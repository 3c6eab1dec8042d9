"""Segment meshes larger than memory in tiles on disk, sorted along a space-filling curve."""
