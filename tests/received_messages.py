"""What arrives on a bus meanwhile."""

import threading

from paramove.bus import BusVisitor


def received_while(folder, topics, act):
    """What arrives on topics while `act()` runs, and shortly after, in the order in which it comes."""
    found, end = [], threading.Event()
    with BusVisitor(folder) as visitor:
        subscribers = [visitor.subscriber(topic) for topic in topics]

        def read():
            while not end.wait(0.002):
                for subscriber in subscribers:
                    subscriber.revive()
                    while (one := subscriber.receive()) is not None:
                        found.append(one)

        reader = threading.Thread(target=read)
        reader.start()
        try:
            act()
            end.wait(0.3)
        finally:
            end.set()
            reader.join()
    return found
