"""Random cases, and what has to hold for each; `tools/fuzz` runs them.

- `files`: damaged files of every format are read, or refused in one line.
- `meshes`: random meshes, segmented with random options.
- `graphs`: random cell graphs, against the readable twins.
- `promises`: what has to hold for labels, and which errors may come.
- `pool`: processes that run cases within limits of time and memory.
- `command`: the command line.

A case is made of a seed and a number alone, so that each can be run again.
"""
