"""Names that other apps use, beside the public names of superfacets."""

from .documents.agreement import rounded as rounded
from .documents.effort import effort_text as effort_text
from .documents.files import Files as Files
from .documents.files import agreed as agreed
from .documents.history import classes_in_work as classes_in_work
from .export.write import parsed_export as parsed_export
from .export.write import write_exports as write_exports
from .labels.classes import new_classes as new_classes
from .web.address import address_file as address_file
from .web.address import open_again as open_again
from .web.address import redirection as redirection
from .web.address import stored_address as stored_address
from .web.server import serve as serve
