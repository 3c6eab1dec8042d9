"""Random cases for `tools/fuzz`, and the properties that must hold for each case.

- `files`: damaged files of every format are read, or refused with a one-line message.
- `labels`: damaged documents of labels, objects and cameras, also as imports of the studio.
- `studio`, `batches`: damaged work files and manifests.
- `meshes`: random meshes, segmented with random options.
- `graphs`: random cell graphs, compared with the reference implementation.
- `cells`: cells of every kind, with masks, barriers, features and levels.
- `sizes`: regions of balanced, limited or exact sizes, for cells of every kind.
- `promises`: properties that must hold for labels, and errors that are allowed.
- `command`: the command line, and the processes that run cases with limits on time and memory.

A case depends only on a seed and a number, so that each case can be repeated.
"""
