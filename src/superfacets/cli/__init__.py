"""The command `superfacets`.

- `main`: the group of commands, and how the process ends. `interrupts`: signals that end it.
- `segment`, `levels`, `batch`, `info`, `convert`, `render`, `regions`, `transfer`, `evaluate`,
  `demo`, `reproduce`, `quality`: one command each, imported when it is called.
- `inputs`, `outputs`: which files a command line means. `failures`: errors as lines and statuses.
- `background`, `progress`: long work that Ctrl-C can end, and the bar that shows how far it is.
- `options`, `segment_options`, `constraints`, `report`: what several commands have in common.
"""
