"""Replacement for the Python package ``segmentator``; see `superfacets.interop.segmentator`."""

from .interop.segmentator import compute_vn, segment_mesh, segment_point

__all__ = ["compute_vn", "segment_mesh", "segment_point"]
