"""Subdivision, facts about meshes, nearest cells, the sample mesh, and whole files."""
