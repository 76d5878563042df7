from .evaluation_io import PROGRESS as PROGRESS
from .evaluation_io import JsonFileOption as JsonFileOption
from .evaluation_io import seeds_in as seeds_in
from .evaluation_io import write_numbers as write_numbers
