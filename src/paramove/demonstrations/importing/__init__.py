"""Files of motion capture read into takes: C3D, BVH, CSV and NPZ."""

from paramove.demonstrations.importing.conversion import ImportOptions, read_mapping_file
from paramove.demonstrations.importing.files import SUFFIXES, Imported, import_file

__all__ = ["SUFFIXES", "ImportOptions", "Imported", "import_file", "read_mapping_file"]
