"""The stages of `segment`, and the values that each stage hands on to the next."""
