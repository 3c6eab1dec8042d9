"""Segment meshes and clouds larger than memory, stored on disk as tiles of nearby cells."""
