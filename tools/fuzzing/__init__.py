"""Random cases, and what has to hold for each; `tools/fuzz` runs them.

- `files`: damaged files of every reader are read, or refused in one short line.
- `studio`, `batches`: damaged work files and manifests.
- `meshes`: random meshes, segmented with random options.
- `graphs`: random cell graphs, against the readable twins.
- `cells`: cells of every kind, with masks, barriers, features and levels.
- `tiles`: labels of tiles, against those in memory.
- `promises`: what has to hold for labels, and which errors may come.
- `command`: the command line, and the processes that run cases within limits of time and memory.

A case is made of a seed and a number alone, so that each can be run again.
"""
