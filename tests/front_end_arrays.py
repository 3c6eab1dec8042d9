"""Decode arrays as the front end does."""

import numpy as np


def decode_arrays(entries, data):
    """Return the arrays in a block of bytes, keyed by name."""
    return {entry["name"]: _decoded(entry, data[entry["offset"] :]) for entry in entries}


def _decoded(entry, data):
    dtype, shape = np.dtype(entry["dtype"]), entry["shape"]
    count = int(np.prod(shape))
    if entry["coding"] == "plain":
        return np.frombuffer(data, dtype.newbyteorder("<"), count).astype(dtype).reshape(shape)
    planes = np.frombuffer(data, np.uint8, count * dtype.itemsize).reshape(dtype.itemsize, count)
    words = np.ascontiguousarray(planes.T).view(f"<u{dtype.itemsize}").ravel()
    if entry["coding"] == "newest":
        is_new = words == 0
        words = (np.cumsum(is_new) - is_new).astype(np.uint32) - words
    else:
        words = words.reshape(*shape[1:], shape[0]).T
    if entry["coding"] == "difference":
        words = np.cumsum(words, axis=0, dtype=words.dtype)
    return np.ascontiguousarray(words).view(dtype).reshape(shape)
