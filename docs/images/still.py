"""A still of a run's video, for the README.

python docs/images/still.py runs/latest/demo.mp4 --at 110 --out docs/images/demo.jpg
"""

import argparse
from pathlib import Path

import cv2


def still(video: Path, at_s: float, out: Path) -> None:
    """Writes the frame of `video` at `at_s` seconds of the video to `out`."""
    capture = cv2.VideoCapture(str(video))
    try:
        capture.set(cv2.CAP_PROP_POS_MSEC, 1e3 * at_s)
        there, picture = capture.read()
    finally:
        capture.release()
    if not there:
        raise SystemExit(f"{video}: no frame at {at_s:g} s")
    cv2.imwrite(str(out), picture, [cv2.IMWRITE_JPEG_QUALITY, 90])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("video", type=Path)
    parser.add_argument("--at", type=float, default=0.0, help="s of the video")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    still(arguments.video, arguments.at, arguments.out)
