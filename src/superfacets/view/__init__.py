"""Stage 7: colors, pictures and pages. The package can be called: it is `superfacets.view`."""

import sys
from types import ModuleType
from typing import Any


class _Package(ModuleType):
    """A module that is a function too: ``superfacets.view`` is the name of both."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Return the page that `superfacets.view.page.document.view` makes."""
        from .page.document import view

        return view(*args, **kwargs)


sys.modules[__name__].__class__ = _Package
