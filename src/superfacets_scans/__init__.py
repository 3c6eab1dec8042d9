"""Superpoints for networks, files of ScanNet, and labels from masks of images."""
