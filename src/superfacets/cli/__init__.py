"""The command `superfacets`."""
