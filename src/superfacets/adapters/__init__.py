"""From paths, arrays and meshes of other libraries to ours."""
