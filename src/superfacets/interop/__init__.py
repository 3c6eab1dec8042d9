"""Store labels in objects of other libraries, and replace functions of other packages."""
