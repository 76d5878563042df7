#!/usr/bin/env bash
# A uint8[] field of a ROS 2 message (sensor_msgs 5.3.6 with rclpy 7.1.6, as wheels) takes a numpy array a thousand times slower than bytes.
#
# Expected: an array of uint8 is copied as memory; if anything is checked element by element, then bytes, whose type is none of ROS's.
# Seen:     bytes and array.array are taken at once, an array of numpy is checked and copied element by element: 20 ms for 200 kB, so a raw
#           image of 1 MB costs more than the period of a camera of 15 Hz. `python -O` changes little. Assign `image.tobytes()`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check 'ros-jazzy-rclpy[fastrtps]==7.1.6' ros-jazzy-sensor-msgs==5.3.6 numpy==2.4.6

cd "$folder"
cat >assign.py <<'END'
import statistics
import time

import numpy as np
from sensor_msgs.msg import Image

pixels = np.zeros(200_000, np.uint8)


def median_s(content):
    times = []
    for _ in range(9):
        message = Image()
        begin = time.perf_counter()
        message.data = content
        times.append(time.perf_counter() - begin)
        assert message.data.tobytes() == pixels.tobytes()
    return statistics.median(times)


of_numpy, of_bytes = median_s(pixels), median_s(pixels.tobytes())
print(f"numpy {1e3 * of_numpy:.2f} ms, bytes {1e3 * of_bytes:.3f} ms")
print("numpy is more than a hundred times slower:", of_numpy > 100 * of_bytes)
END
venv/bin/python assign.py >seen
cat seen
grep -q "slower: True" seen
