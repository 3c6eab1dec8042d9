"""Public names, and names that other apps use."""

from .border_files import LINE_ENDINGS as LINE_ENDINGS
from .border_files import write_borders as write_borders
from .camera import VIEW_NAMES as VIEW_NAMES
from .camera import Clip as Clip
from .camera import Up as Up
from .colors import PALETTE as PALETTE
from .colors import color_distances as color_distances
from .page.coding import Arrays as Arrays
from .page.document import checked_page_path as checked_page_path
from .page.own_colors import color_parts as color_parts
from .page.shape import shape_of as shape_of
from .page.texture import texture_parts as texture_parts
from .rendering import check_rendering as check_rendering
from .scene import MOST_CUT as MOST_CUT
