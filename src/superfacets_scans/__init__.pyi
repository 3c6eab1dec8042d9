"""Names that other apps use, beside the public names of superfacets."""

from .label_images import Overlap as Overlap
from .scannet import GROUPS as GROUPS
from .scannet import NO_CLASS as NO_CLASS
from .scannet import SEGMENTS as SEGMENTS
from .scannet import scene_of as scene_of
from .scannet import write_groups as write_groups
from .scannet import write_segments as write_segments
from .scannet import write_sstk as write_sstk
