"""Public names, and names that other apps use."""

from .images import TextureImage as TextureImage
from .images import check_pixels as check_pixels
from .light import linear_of_oklab as linear_of_oklab
from .light import linear_of_srgb as linear_of_srgb
from .light import oklab_of_linear as oklab_of_linear
from .light import srgb_of_linear as srgb_of_linear
from .texels import FaceTexels as FaceTexels
from .texels import check_texture as check_texture
from .texels import texture_colors as texture_colors
from .textures import WRAPS as WRAPS
from .textures import Material as Material
from .writing import notes_on_texture as notes_on_texture
