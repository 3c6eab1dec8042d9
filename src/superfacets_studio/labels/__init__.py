"""Represent and encode the classes, objects and suggestions of cells."""
