"""Public names, and names that other apps use."""

from .aggregation import RegroupedObject as RegroupedObject
from .aggregation import group_segments as group_segments
from .aggregation import regroup_segments as regroup_segments
from .label_images import Overlap as Overlap
from .lifting import LiftedLabels as LiftedLabels
from .lifting import project_labels as project_labels
from .mask_votes import ViewWarning as ViewWarning
from .pyg import write_graphs as write_graphs
from .scannet import GROUPS as GROUPS
from .scannet import NO_CLASS as NO_CLASS
from .scannet import SEGMENTS as SEGMENTS
from .scannet import scene_of as scene_of
from .scannet import write_groups as write_groups
from .scannet import write_segments as write_segments
from .scannet import write_sstk as write_sstk
