"""The names of the kit and where they live; each is imported when it is first used."""

# ruff: isort: skip_file

# Types in signatures
from .base.types import Array as Array
from .base.types import Bools as Bools
from .base.types import Bytes as Bytes
from .base.types import Floats as Floats
from .base.types import Ints as Ints
from .base.types import Longs as Longs
from .files.atomic import StrPath as StrPath
from .mesh.convert import MeshLike as MeshLike
from .mesh.base import Cells as Cells
from .mesh.faces import FaceMesh as FaceMesh

# Checks of arguments, and words for messages
from .base.checks import checked_threads as checked_threads
from .base.checks import checked_count as checked_count
from .base.checks import checked_number as checked_number
from .base.checks import checked_flag as checked_flag
from .base.checks import checked_choice as checked_choice
from .base.checks import check_length as check_length
from .base.checks import checked_classes as checked_classes
from .base.checks import ranked_labels as ranked_labels
from .base.checks import compact_partial_labels as compact_partial_labels
from .base.checks import refuse_mask as refuse_mask
from .base.checks import counted as counted
from .base.text import shortened as shortened
from .base.errors import reason_of as reason_of
from .base.errors import import_extra as import_extra
from .base.lazy import Table as Table
from .base.lazy import lazy_names as lazy_names
from .base.checks import freeze as freeze

# Meshes, clouds and their cells
from .mesh.convert import as_mesh as as_mesh
from .mesh.convert import as_cells as as_cells
from .graph.kinds import kind_of as kind_of
from .graph.kinds import Kind as Kind
from .graph.cell_graph import BaseGraph as BaseGraph
from .graph.tet_cells import TetCells as TetCells
from .tools.texels import Texels as Texels
from .mesh.faces import corners_of as corners_of
from .mesh.faces import corner_triangles as corner_triangles
from .mesh.faces import cut_into_triangles as cut_into_triangles
from .mesh.weld import lowest_vertices as lowest_vertices
from .graph.kinds import of_cells as of_cells
from .graph.sums import weighted_majority as weighted_majority
from .graph.sums import sums_by_label as sums_by_label
from .graph.surface import Surface as Surface
from .regions.crease_labels import VertexEdges as VertexEdges
from .regions.shared_masks import MaskedAreas as MaskedAreas
from .weights.formulas import WEIGHTS as WEIGHTS

# Reading files
from .files.input import Input as Input
from .files.input import Read as Read
from .files.formats import FORMATS as FORMATS
from .files.guards import Content as Content
from .files.guards import read_content as read_content
from .files.guards import open_regular as open_regular
from .files.atomic import open_own as open_own
from .files.guards import known_ending as known_ending
from .files.guards import named_errors as named_errors
from .base.text import parsed_json as parsed_json
from .files.guards import BinaryReader as BinaryReader
from .files.readers.text import Lines as Lines
from .files.readers.text import as_integers as as_integers
from .files.readers.text import shown as shown
from .files.readers.gltf import GltfScene as GltfScene
from .files.guards import file_beside as file_beside
from .files.guards import most_bytes_of as most_bytes_of
from .base.arrays import rotation_of as rotation_of
from .files.guarded import guarded as guarded
from .files.readers.npy import npy_array as npy_array
from .mesh.attributes import stored_colors as stored_colors
from .tools.named_features import CellData as CellData
from .tools.cell_file import CellFile as CellFile

# Writing files
from .files.writers.cells import Output as Output
from .files.atomic import atomic_outputs as atomic_outputs
from .files.atomic import checked_targets as checked_targets
from .files.atomic import output_folder as output_folder
from .files.atomic import locked as locked
from .files.writers.text_formats import write_rows as write_rows
from .files.writers.text_formats import number_format as number_format
from .files.writers.cells import FormatOptions as FormatOptions

# Whole files
from .tools.segment_file import FileOptions as FileOptions
from .files.writers.write import OutputFiles as OutputFiles
from .files.writers.write import Written as Written
from .tools.sources import InputFile as InputFile
