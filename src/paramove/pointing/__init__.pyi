from .source import PointingSetup as PointingSetup
