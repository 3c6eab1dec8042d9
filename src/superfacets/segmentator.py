"""Replacement for the Python package ``segmentator``; see `superfacets_scans.segmentator`."""

from superfacets_scans.segmentator import compute_vn, segment_mesh, segment_point

__all__ = ["compute_vn", "segment_mesh", "segment_point"]
