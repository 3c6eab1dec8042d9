"""The command `superfacets`.

- `main`: the entry point. Most commands are in a module of the same name, which is imported only
  when the command is called.
- `inputs`, `outputs`: reading of input files, and planning of output files.
- `options`, `segment_options`: options that several commands share.
- `progress`: progress bars. `report`: notes and summaries. `failures`: error messages.
- `interrupts`: signal handling, and background threads.
"""
