"""The command `superfacets`.

- `main`: the group of commands, and exit statuses. Each command is in the module of its name, which
  is imported when the command is called.
- `inputs`, `outputs`: the files of a command line. `options`, `segment_options`: shared options.
- `progress`: bars. `report`: notes and results. `failures`: errors as lines and exit statuses.
- `interrupts`: signals, and work that a signal can end.
"""
