"""Names that other apps use, beside the public names of superfacets."""

from .images import check_pixels as check_pixels
from .light import linear_of_oklab as linear_of_oklab
from .light import linear_of_srgb as linear_of_srgb
from .light import oklab_of_linear as oklab_of_linear
from .light import srgb_of_linear as srgb_of_linear
from .texels import check_texture as check_texture
from .textures import WRAPS as WRAPS
from .writing import notes_on_texture as notes_on_texture
