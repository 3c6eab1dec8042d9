"""Names for apps and formats that build on this package, beside the public names.

`kit.pyi` lists them by purpose. Each name is imported on first use. Names change only with an entry
in the changelog.
"""

from .base.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
