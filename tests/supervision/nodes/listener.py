"""A node that hears the robot's words; only its interface is of use."""

from paramove.bus import topics
from paramove.bus.node import NodeConfig

SUBSCRIBES = (topics.SPEECH,)
PUBLISHES = ()


class Config(NodeConfig):
    loudness: float = 1.0
    language: str = "en"
