"""Files of motion capture read into takes: C3D, BVH, CSV and NPZ."""

from paramove.demonstrations.importing.conversion import ImportOptions, axes_matrix, read_mapping_file
from paramove.demonstrations.importing.files import SUFFIXES, Imported, import_file

__all__ = ["SUFFIXES", "ImportOptions", "Imported", "axes_matrix", "import_file", "read_mapping_file"]
