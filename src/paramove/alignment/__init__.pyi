from .warping import Alignment as Alignment
from .warping import movement_distance as movement_distance
from .warping import warp as warp
