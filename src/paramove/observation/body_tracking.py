"""The stereo body tracker on streams of images: aligns them, locates the arm, makes its messages, reports problems."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from pydantic import BaseModel, ConfigDict, Field, model_validator

from paramove.cameras import AlignedViews, CalibratedCamera, CameraWatch, Views, measured_cameras
from paramove.documents import Image, InputError
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.objects import Colour
from paramove.observation.arm_messages import GREEN, add_circle, line_in_image, line_in_scene, pose_message
from paramove.observation.markers import ArucoMarker, BodyTrackerOptions, MarkedPoint, StereoBodyTracker

ALONG_THE_ARM = ("sternum", "shoulder", "elbow", "wrist", "knuckle", "index")
UNDETECTED_S = 3.0
"""A point that two cameras have not detected for this long is reported. A hand below the table returns sooner."""


@dataclass(frozen=True)
class BodyPoints:
    """The marked points at one time.

    Attributes:
        captured_ns: Of the images.
        points: Those that at least two cameras detected.
    """

    captured_ns: int
    points: Mapping[str, MarkedPoint]


class BodyTracking:
    """Aligns the images of the cameras in time and locates the marked points in them.

    Args:
        cameras: As calibrated.
        options: What marks which point.
        period_s: Time between two images of a camera, s.

    Attributes:
        cameras: By their names.
        point_names: Of the marked points.
        watch: Which cameras give usable images; takes the time, and images that cannot be decoded.

    Raises StereoError for fewer than two cameras, InputError for duplicate markers or none.
    """

    def __init__(self, cameras: Sequence[CalibratedCamera], options: BodyTrackerOptions, period_s: float) -> None:
        self._tracker = StereoBodyTracker(cameras, options)
        self.cameras = {camera.name: camera for camera in cameras}
        self.point_names = tuple(options.markers)
        self._views = AlignedViews[Image](list(self.cameras), period_s)
        self.watch = CameraWatch(cameras, period_s)
        self._detected_ns: dict[str, int] = {}
        self._latest_ns = 0

    def see(self, camera: str, captured_ns: int, image: Image) -> Iterator[BodyPoints]:
        """The points at each time that this image of a calibrated camera completes.

        An image of another size than calibrated is ignored and reported; a late one is ignored silently.
        """
        if self.watch.accepts(camera, captured_ns, image):
            for views in self._views.add(camera, captured_ns, image):
                yield self._located(views)

    def trouble(self) -> str:
        """Cameras without usable images and points that are not detected; "" if nothing is wrong."""
        return "; ".join([*self.watch.troubles(), *self._undetected()])

    def _located(self, views: Views[Image]) -> BodyPoints:
        points = self._tracker.located(views.images)
        self._latest_ns = views.captured_ns
        for name in self.point_names:
            self._detected_ns.setdefault(name, views.captured_ns)
            if name in points:
                self._detected_ns[name] = views.captured_ns
        return BodyPoints(views.captured_ns, points)

    def _undetected(self) -> list[str]:
        names = [
            name
            for name, detected_ns in self._detected_ns.items()
            if self._latest_ns - detected_ns > UNDETECTED_S * 1e9
        ]
        if not names:
            return []
        return [f"fewer than two cameras see {', '.join(names)}: turn the markers to the cameras, or check the light"]


def body_messages(body: BodyPoints, camera: CalibratedCamera) -> tuple[ArmPose, ImageAnnotations, SceneUpdate]:
    """All that is published of a time; the points are drawn joined by a line, in a camera's image and in the world."""
    positions = {name: point.position for name, point in body.points.items()}
    along = [positions[name] for name in sorted(positions, key=_from_the_body)]
    pixels = [pixel for pixel in map(camera.project, along) if np.isfinite(pixel).all()]
    outline = line_in_image(body.captured_ns, pixels, GREEN, closed=False)
    for pixel in pixels:
        add_circle(outline, pixel, 5.0, GREEN)
    return pose_message(body.captured_ns, positions), outline, line_in_scene(body.captured_ns, "arm", along)


def _from_the_body(name: str) -> int:
    """Place of a point from the body to the end of the hand; unknown names are last."""
    return ALONG_THE_ARM.index(name) if name in ALONG_THE_ARM else len(ALONG_THE_ARM)


class MarkerSetup(BaseModel):
    """What marks a point of the arm: a printed marker with its number, or a colour that nothing else in view has.

    Attributes:
        number: Of an ArUco marker, 60 to 99; `paramove calibrate markers` prints them.
        inset: How deep below the marker's middle the point lies, m.
        hue_deg: Lower and upper hue of a colour, degrees.
        saturation: Its smallest saturation, 0 to 1.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    number: int | None = None
    inset: float = 0.0
    hue_deg: tuple[float, float] | None = None
    saturation: float = 0.45

    @model_validator(mode="after")
    def _check(self) -> MarkerSetup:
        if (self.number is None) == (self.hue_deg is None):
            raise ValueError("a marker has either a number or a colour (hue_deg: [lower, upper])")
        return self

    def marker(self, name: str) -> ArucoMarker | Colour:
        """For `StereoBodyTracker`. Raises InputError for an invalid number or colour."""
        if self.hue_deg is None:
            assert self.number is not None
            return ArucoMarker(self.number, self.inset)
        try:
            return Colour(name, self.hue_deg, self.saturation)
        except ValueError as error:
            raise InputError(str(error)) from error


class BodyTrackingSetup(BaseModel):
    """Parameters of a body tracker. Its files are looked for in the run's folder first, then in the workspace.

    Attributes:
        cameras: Calibration file; its cameras are camera_1, camera_2, … in their order.
        markers: Name of a point of the arm, as `ArmPose` has it -> what marks it.
        max_residual_px: A point whose views disagree by more is rejected.
        rate_hz: Of the cameras.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    cameras: Path = Path("cameras.yaml")
    markers: dict[str, MarkerSetup] = Field(
        default={"elbow": MarkerSetup(number=91), "wrist": MarkerSetup(number=92), "index": MarkerSetup(number=93)},
        min_length=1,
    )
    max_residual_px: float = Field(default=BodyTrackerOptions.max_residual_px, gt=0.0, le=50.0)
    rate_hz: float = Field(default=15.0, gt=0.5, le=240.0)

    def body_tracking(self, run_folder: Path = Path()) -> BodyTracking:
        """Reads the calibration. Raises InputError."""
        cameras = measured_cameras(run_folder, self.cameras)
        markers = {name: one.marker(name) for name, one in self.markers.items()}
        options = BodyTrackerOptions(markers=markers, max_residual_px=self.max_residual_px)
        return BodyTracking(cameras, options, 1.0 / self.rate_hz)
