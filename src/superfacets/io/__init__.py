"""Files: reading and writing of meshes and labels, with numpy alone."""
