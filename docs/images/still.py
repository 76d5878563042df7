"""A still or a loop of a run's video, for the README.

python docs/images/still.py runs/latest/demo.mp4 --at 110 --out docs/images/demo.jpg
python docs/images/still.py runs/latest/demo.mp4 --at 100 --until 140 --speed 3 --out docs/images/demo.webp
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
import PIL.Image

WIDTH_PX, RATE_HZ, QUALITY = 800, 10.0, 50


def frame(video: cv2.VideoCapture, at_s: float) -> np.ndarray:
    """The picture at `at_s` seconds of the video, BGR."""
    video.set(cv2.CAP_PROP_POS_MSEC, 1e3 * at_s)
    there, picture = video.read()
    if not there:
        raise SystemExit(f"the video has no frame at {at_s:g} s")
    return picture


def loop(video: cv2.VideoCapture, times_s: np.ndarray, out: Path) -> None:
    """Writes the pictures at these times, smaller, as one that moves."""
    pictures = []
    for at_s in times_s:
        picture = frame(video, at_s)
        size = (WIDTH_PX, round(WIDTH_PX * picture.shape[0] / picture.shape[1]))
        smaller = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        pictures.append(PIL.Image.fromarray(cv2.cvtColor(smaller, cv2.COLOR_BGR2RGB)))
    first, *others = pictures
    first.save(out, save_all=True, append_images=others, duration=round(1e3 / RATE_HZ), loop=0, quality=QUALITY)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("video", type=Path)
    parser.add_argument("--at", type=float, default=0.0, help="s of the video")
    parser.add_argument("--until", type=float, help="s of the video: a loop")
    parser.add_argument("--speed", type=float, default=1.0, help="of the loop")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    opened = cv2.VideoCapture(str(arguments.video))
    if arguments.until is None:
        cv2.imwrite(str(arguments.out), frame(opened, arguments.at), [cv2.IMWRITE_JPEG_QUALITY, 90])
    else:
        loop(opened, np.arange(arguments.at, arguments.until, arguments.speed / RATE_HZ), arguments.out)
    opened.release()
