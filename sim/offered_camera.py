"""A simulated camera behind a socket, as a webcam is behind its device: for a run that knows of no simulation."""

from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Iterator
from pathlib import Path

import mujoco
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.bus import Topic
from paramove.cameras import Frame, encode, framed, image_of_raw, short_name
from sim.camera import ImageSource

JPEG_QUALITY = 95
SEND_TIMEOUT_S = 0.5


class OfferedCamera:
    """See `ImageSource`; nothing is published. Who is connected gets each image, the latest who came.

    Args:
        camera: Whose images are offered.
        path: Of the socket; one that is there already is replaced.
    """

    def __init__(self, camera: ImageSource, path: Path) -> None:
        self._camera, self._path = camera, path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        self._listener = socket.socket(socket.AF_UNIX)
        with short_name(path) as name:
            self._listener.bind(name)
        self._listener.listen()
        self._client: socket.socket | None = None

    def images(self, data: mujoco.MjData, tick: int, now_ns: int) -> Iterator[tuple[Topic, RawImage]]:
        """See `ImageSource.images`."""
        for _, image in self._camera.images(data, tick, now_ns):
            if select.select([self._listener], [], [], 0.0)[0]:
                self._disconnect()
                self._client = self._listener.accept()[0]
                self._client.settimeout(SEND_TIMEOUT_S)
            self._send(image)
        return iter(())

    def close(self) -> None:
        """Ends the offer, and gives the graphics context back."""
        self._disconnect()
        self._listener.close()
        self._path.unlink(missing_ok=True)
        self._camera.close()

    def _send(self, image: RawImage) -> None:
        if self._client is None or not select.select([], [self._client], [], 0.0)[1]:
            return
        try:
            self._client.sendall(framed(encode(Frame(image_of_raw(image), 0, 0), JPEG_QUALITY).data))
        except OSError:  # gone, or too slow for half an image
            self._disconnect()

    def _disconnect(self) -> None:
        with contextlib.suppress(OSError):
            if self._client is not None:
                self._client.close()
        self._client = None
