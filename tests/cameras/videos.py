"""Videos whose frames show their own number, as phones, browsers and screen recorders write them."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

WIDTH_PX, HEIGHT_PX = 64, 48
LEVEL_STEP = 2
"""Grey levels between two frames."""
KINDS = {
    "phone.mp4": ("mp4", "libx264", Fraction(1, 90000), 30, {}),
    "fragments.mp4": ("mp4", "libx264", Fraction(1, 90000), 30, {"movflags": "frag_keyframe+empty_moov"}),
    "phone.mov": ("mov", "mpeg4", Fraction(1, 600), 30, {}),
    "screen.mkv": ("matroska", "libx264", Fraction(1, 1000), 30, {}),
    "browser.webm": ("webm", "libvpx", Fraction(1, 1000), 1000, {"live": "1"}),
    "pictures.mkv": ("matroska", "mjpeg", Fraction(1, 1000), 30, {}),
}
"""Format, codec, unit of time, nominal rate and the container's options."""


def write_video(
    path: Path, times_s: Sequence[float], kind: str = "pictures.mkv", stamp: Callable[[float], float] | None = None
) -> Path:
    """A video whose frame n is captured at `times_s[n]`; `stamp` gives other stamps than these, none earlier."""
    container_format, codec, unit, rate_hz, options = KINDS[kind]
    with av.open(str(path), "w", format=container_format, options=options) as container:
        stream = container.add_stream(codec, rate=rate_hz)
        stream.width, stream.height = WIDTH_PX, HEIGHT_PX
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        stream.time_base = stream.codec_context.time_base = unit

        def mux(packets):
            for packet in packets:
                if stamp is not None:
                    packet.pts = round(stamp(float(packet.pts * unit)) / unit)
                container.mux(packet)

        for number, time_s in enumerate(times_s):
            grey = np.full((HEIGHT_PX, WIDTH_PX, 3), 20 + LEVEL_STEP * (number % 100), np.uint8)
            frame = av.VideoFrame.from_ndarray(grey, format="bgr24")
            frame.pts, frame.time_base = round(time_s / unit), unit
            mux(stream.encode(frame))
        mux(stream.encode())
    return path


def presentation_times(path: Path) -> list[float]:
    """Times, s, of the frames by PyAV, from the first one on."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        times_s = [float(frame.pts * stream.time_base) for frame in container.decode(stream)]
    return [time_s - times_s[0] for time_s in times_s]
