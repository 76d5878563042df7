"""How long a stop takes from the page's socket to the arm's gate, in real time, with the real nodes.

python benchmarks/stop_button.py [--presses 20]

A robot that only plays its stream is moved by the real driver; at some time of the movement the stop is sent through
the page's socket. Measured on the wall clock, each time with new processes: until the gate reports "stopping", and
until the robot has the batch with the stop ramp.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import urlopen

import numpy as np
from websockets.sync.client import connect
from websockets.typing import Origin

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from paramove.bus import Bus, BusSettings, Tick, topics  # noqa: E402
from paramove.dashboard import Side, link_in, nonce, proof  # noqa: E402
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory  # noqa: E402
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState  # noqa: E402
from paramove.robots import RobotDescription  # noqa: E402
from paramove.robots.hoap3 import receive, state_message  # noqa: E402
from paramove.robots.streaming import StreamReader  # noqa: E402
from paramove.safety import minimum_jerk  # noqa: E402

HOAP3 = RobotDescription.load(ROOT / "robot_description" / "hoap3")
SWING_DEG = {"right_shoulder_pitch": -50.0, "right_elbow": -40.0}
"""From the base pose, in 3 s."""
SUBSCRIBES = (topics.ARM_SAFETY, topics.WIRE_HOAP3_STREAM)
PUBLISHES = (topics.WIRE_HOAP3_STATE, topics.OPERATOR_ARM, topics.ARM_TRAJECTORY)


class World:
    """The robot's side of the wire and the person at the page."""

    def __init__(self, folder: Path, press_at_s: float) -> None:
        self.bus = Bus("world", BusSettings(folder=folder / "bus"), SUBSCRIBES, PUBLISHES)
        self.folder = folder
        self.reader = StreamReader(HOAP3, HOAP3.units.to_counts(HOAP3.base_pose))
        self.press_at_s = press_at_s
        self.moving_s = self.pressed_s = self.stopping_s = self.batch_s = 0.0

    def run(self) -> tuple[float, float]:
        """Seconds from the press to "stopping" and to the batch with the ramp."""
        played_s = time.monotonic()
        with self.bus:
            for event in self.bus.events(*SUBSCRIBES, tick=True):
                now_s = time.monotonic()
                if isinstance(event, Tick):
                    for _ in range(round(1e3 * (now_s - played_s))):
                        self.reader.play()
                    played_s = now_s
                    state = self.reader.state(self.reader.target, event.now_ns)
                    self.bus.publish(topics.WIRE_HOAP3_STATE, state_message(state))
                    if self.moving_s and not self.pressed_s and now_s - self.moving_s > self.press_at_s:
                        self.pressed_s = float("inf")
                        threading.Thread(target=self._press, daemon=True).start()
                elif event.topic is topics.WIRE_HOAP3_STREAM:
                    receive(event.message, self.reader)
                    if self.stopping_s and not self.batch_s:
                        self.batch_s = now_s
                elif event.message.state == SafetyState.STATE_DISARMED:
                    self.bus.publish(topics.OPERATOR_ARM, ArmRequest(source="benchmark", armed=True, by_person=True))
                elif event.message.state == SafetyState.STATE_ARMED and not self.moving_s and link_in(self.folder):
                    self.moving_s = now_s
                    self.bus.publish(topics.ARM_TRAJECTORY, swing())
                elif event.message.state == SafetyState.STATE_STOPPING and not self.stopping_s:
                    self.stopping_s = now_s
                elif event.message.state == SafetyState.STATE_HOLD:
                    break
        return self.stopping_s - self.pressed_s, (self.batch_s or self.stopping_s) - self.pressed_s

    def _press(self) -> None:
        link = link_in(self.folder)
        assert link is not None
        host = urlsplit(link).netloc
        with urlopen(link) as page:
            key = page.read().decode().partition('name="paramove-key" content="')[2].partition('"')[0]
        with connect(f"ws://{host}/live", origin=Origin(f"http://{host}"), compression=None) as live:
            mine = nonce()
            live.send(mine)
            theirs, _ = str(live.recv()).split()
            live.send(proof(key, Side.BROWSER, host, mine, theirs))
            live.recv()
            self.pressed_s = time.monotonic()
            live.send("stop")
            live.recv(60)


def swing() -> JointTrajectory:
    """From the base pose along a minimum-jerk path, points 10 ms apart."""
    message = JointTrajectory(id="one", joints=list(SWING_DEG))
    start = HOAP3.base_pose[HOAP3.indices(message.joints)]
    for u in np.linspace(0.0, 1.0, 301):
        position = start + minimum_jerk(u) * np.deg2rad(list(SWING_DEG.values()))
        message.points.add(time_s=3.0 * u, position_rad=position)
    return message


def measure(press_at_s: float) -> tuple[float, float]:
    """One stop with new processes."""
    with tempfile.TemporaryDirectory(prefix="paramove-") as name:
        folder = Path(name)
        processes = []
        try:
            for node in ("dashboard", "arm_driver"):
                config = folder / f"{node}.yaml"
                bus = {"folder": str(folder / "bus"), "clock": "monotonic"}
                config.write_text(json.dumps({"node": node, "bus": bus, "parameters": {}, "run_folder": name}))
                command = [sys.executable, "-m", f"nodes.{node}", "--config", str(config)]
                processes.append(subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL))
            return World(folder, press_at_s).run()
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                process.wait()


def main() -> None:
    """Prints median and largest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--presses", type=int, default=20)
    times_s = np.linspace(0.4, 1.8, parser.parse_args().presses)
    delays_ms = 1e3 * np.array([measure(float(time_s)) for time_s in times_s])
    for what, times in zip(("gate reports stopping", "robot has the stop ramp"), delays_ms.T, strict=True):
        sys.stdout.write(f"{what:<24} median {np.median(times):6.1f} ms   largest {times.max():6.1f} ms\n")


if __name__ == "__main__":
    main()
