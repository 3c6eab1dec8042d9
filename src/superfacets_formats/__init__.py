"""Formats of lidar, scanners, VTK, Gmsh, Medit, the cortex, and compressed glTF."""
