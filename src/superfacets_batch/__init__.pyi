"""Public names, and names that other apps use."""

from .batching import BatchProgress as BatchProgress
from .batching import BatchResult as BatchResult
