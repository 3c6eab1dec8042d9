"""Segment meshes and clouds larger than memory, split on disk into tiles of nearby cells."""
