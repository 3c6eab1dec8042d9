"""The work on a mesh: its state, changes, undo history, work file, and the open documents."""
