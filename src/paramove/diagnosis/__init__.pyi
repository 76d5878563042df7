from .bus_findings import bus_findings as bus_findings
from .examination import examined as examined
from .finding import Finding as Finding
from .finding import Level as Level
from .finding import Machine as Machine
from .finding import Part as Part
from .graphics import graphics_backend as graphics_backend
