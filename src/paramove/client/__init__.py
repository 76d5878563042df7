"""A running application from a program of one's own: read its topics, publish, send a goal, stop.

import paramove

with paramove.connect() as run:
    print(run.latest("arm/safety").state)
    for received in run.listen("objects/tracked", seconds=5.0):
        print(received.message)
    run.stop()
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
