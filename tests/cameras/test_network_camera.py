"""Cameras of the network: a server on loopback streams MJPEG, stalls, says nothing, or is none."""

import http.server
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import numpy as np
import pytest

from paramove.cameras.frame_sources import FrameSource, SourceError, is_network_camera, open_source, without_password
from paramove.cameras.frames import Frame, FrameError

DEADLINE_S = 20.0


class Streams(http.server.BaseHTTPRequestHandler):
    """As many pictures as the server still has, then silence."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        while not self.server.ended.wait(0.02):
            if self.server.pictures == 0:
                continue
            self.server.pictures -= 1
            _, data = cv2.imencode(".jpg", np.full((48, 64, 3), 100, np.uint8))
            head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
            try:
                self.wfile.write(head.encode() + data.tobytes() + b"\r\n")
            except OSError:
                return

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def camera(pictures: int) -> Iterator[http.server.ThreadingHTTPServer]:
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Streams) as server:
        server.ended = threading.Event()
        server.pictures = pictures
        serving = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        serving.start()
        try:
            yield server
        finally:
            server.ended.set()
            server.shutdown()
            serving.join()


def next_event(source: FrameSource) -> Frame | FrameError:
    begun_s = time.monotonic()
    while time.monotonic() - begun_s < DEADLINE_S:
        try:
            frame = source.frame(time.monotonic_ns())
        except FrameError as fault:
            return fault
        if frame is not None:
            return frame
    raise AssertionError("neither a frame nor a fault")


def next_frame(source: FrameSource) -> Frame:
    frame = next_event(source)
    assert isinstance(frame, Frame)
    return frame


def next_fault(source: FrameSource) -> FrameError:
    while isinstance(event := next_event(source), Frame):
        pass
    return event


def test_a_network_camera_gives_frames_and_its_silence_is_reported() -> None:
    with camera(pictures=20) as server:
        source = open_source(f"device:http://127.0.0.1:{server.server_port}/video", 64, 48)
        assert next_frame(source).image_bgr.shape == (48, 64, 3)
        assert next_fault(source).kind in ("silent", "missing")
        server.pictures = 1000
        while isinstance(came := next_event(source), FrameError):
            pass
        assert came.index > 0
        source.close()


def test_a_silent_network_camera_is_rejected_soon_and_without_its_password() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        begun_s = time.monotonic()
        with pytest.raises(SourceError) as rejection:
            open_source(f"device:http://user:secret@127.0.0.1:{silent.getsockname()[1]}/video", 64, 48)
        assert time.monotonic() - begun_s < 5.0
    assert rejection.value.exit_code == 66
    assert "127.0.0.1" in str(rejection.value)
    assert "secret" not in str(rejection.value)


@pytest.mark.parametrize("url", ["ftp://camera/video", "file:///etc/passwd", "concat://a"])
def test_another_kind_of_address_names_those_that_are_supported(url: str) -> None:
    with pytest.raises(SourceError, match=r"http://, https://, rtsp://"):
        open_source(f"device:{url}", 64, 48)


def test_what_is_a_network_camera() -> None:
    assert is_network_camera("RTSP://camera.local/stream")
    assert not any(map(is_network_camera, ("/dev/video0", "0", "socket", "device:http://a", "folder/http://b")))
    assert without_password("device:rtsp://a:b@c/d@e") == "device:rtsp://c/d@e"
