"""pypot: the protocol written in Python over pyserial; its tables are of another servo (XL-320)."""

import sys

from pypot.dynamixel.io import Dxl320IO

bus = Dxl320IO(sys.argv[1], 1_000_000, timeout=0.5)
assert bus.scan(range(6)) == [1, 2, 3]
assert bus.ping(1)
assert not bus.ping(5)
bus.close()
sys.stdout.write("ping, scan")
