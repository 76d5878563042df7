from .conversion import ImportOptions as ImportOptions
from .conversion import axes_matrix as axes_matrix
from .conversion import read_mapping_file as read_mapping_file
from .files import SUFFIXES as SUFFIXES
from .files import Imported as Imported
from .files import import_file as import_file
