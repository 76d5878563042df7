#!/usr/bin/env bash
# ezc3d 1.7.2 writes a C3D file of 70 000 frames whose header and POINT:FRAMES say 65 535, and reads back as many, without an error.
#
# Expected: what is written is read again (C3D has long counts in POINT:LONG_FRAMES and TRIAL:ACTUAL_END_FIELD), or writing raises.
# Seen:     the file has the bytes of all 70 000 frames, but its counts stop at 65 535, and neither LONG_FRAMES nor a TRIAL group is
#           written. Reading gives the first 65 535 frames: at 100 Hz whatever comes after 10 min 55 s is lost, and nothing says so.
#           Compare the size of the file with its counts before you trust a long capture, or split it before it is written.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check ezc3d==1.7.2 numpy==2.2.6

cd "$folder"
cat >capture.py <<'END'
import os

import ezc3d
import numpy as np

FRAME_BYTES = 16  # four floats for the one point


def written(frames):
    capture = ezc3d.c3d()
    capture["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    capture["parameters"]["POINT"]["LABELS"]["value"] = ("index",)
    points = np.ones((4, 1, frames))
    points[0, 0] = np.arange(frames)
    capture["data"]["points"] = points
    name = f"{frames}.c3d"
    capture.write(name)
    return name


for frames in (65_000, 70_000):
    name = written(frames)
    read = ezc3d.c3d(name)
    parameters = read["parameters"]
    has_long_counts = "LONG_FRAMES" in parameters["POINT"] or "TRIAL" in parameters
    x = read["data"]["points"][0, 0]
    print(
        f"written {frames}: room for all {os.path.getsize(name) >= frames * FRAME_BYTES}, "
        f"POINT:FRAMES {parameters['POINT']['FRAMES']['value'][0]}, long counts {has_long_counts}, "
        f"read {len(x)}, the last of them {x[-1]:.0f}"
    )
END
venv/bin/python capture.py >seen

cat >expected <<'END'
written 65000: room for all True, POINT:FRAMES 65000, long counts False, read 65000, the last of them 64999
written 70000: room for all True, POINT:FRAMES 65535, long counts False, read 65535, the last of them 65534
END
cat seen
diff expected seen
