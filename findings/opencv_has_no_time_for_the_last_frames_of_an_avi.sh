#!/usr/bin/env bash
# OpenCV 4.14.0 gives the last frames of an AVI with B-frames the time 0.
#
# Expected: CAP_PROP_POS_MSEC after grab() is the presentation time of each frame, as in Matroska and as PyAV 18.1.0 has it.
# Seen:     with two B-frames OpenCV's times begin one frame (MPEG-4) or two (H.264) late, and are 0 for as many at the end. Whoever
#           takes these times as they are sees a jump to the beginning at the end of the film; where a time goes back, count on from
#           the frame before.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check av==18.1.0 opencv-contrib-python-headless==4.14.0.94

cd "$folder"
cat >film.py <<'END'
import av
import cv2
import numpy as np

RATE_HZ = 10
FRAMES = 8


def written(container, codec):
    name = f"{codec}.{container}"
    with av.open(name, "w") as film:
        stream = film.add_stream(codec, rate=RATE_HZ, options={"bf": "2"})
        stream.width = stream.height = 64
        stream.pix_fmt = "yuv420p"
        for number in range(FRAMES):
            image = np.full((64, 64, 3), 20 * number, np.uint8)
            image[:, 6 * number : 6 * number + 6] = 255
            film.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        film.mux(stream.encode(None))
    return name


def times_of_opencv(name):
    film = cv2.VideoCapture(name)
    times = []
    while film.grab():
        times.append(round(film.get(cv2.CAP_PROP_POS_MSEC)))
    return times


def times_of_pyav(name):
    with av.open(name) as film:
        return [round(1000 * frame.pts * frame.time_base) for frame in film.decode(video=0)]


for container, codec in (("mkv", "libx264"), ("avi", "mpeg4"), ("avi", "libx264")):
    name = written(container, codec)
    print(container, codec, "OpenCV", *times_of_opencv(name))
    print(container, codec, "PyAV  ", *times_of_pyav(name))
END
venv/bin/python film.py >seen

cat >expected <<'END'
mkv libx264 OpenCV 0 100 200 300 400 500 600 700
mkv libx264 PyAV   0 100 200 300 400 500 600 700
avi mpeg4 OpenCV 100 200 300 400 500 600 700 0
avi mpeg4 PyAV   100 200 300 400 500 600 700 800
avi libx264 OpenCV 200 300 400 500 600 700 0 0
avi libx264 PyAV   100 200 300 400 500 600 700 800
END
cat seen
diff expected seen
