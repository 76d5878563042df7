"""Positions and timeouts of rule learning and relocation by pointing, as parameters of their processes.

Positions depend on robot and world: the launch files give them.
"""

from __future__ import annotations

from typing import ClassVar, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from paramove.documents import OldNames

Place = tuple[float, float]
Range = tuple[float, float]
Pointing = Literal["nearness", "action_space"]


def within(place: Place, x: Range, y: Range, margin: float = 0.0) -> bool:
    """Whether a position lies in a rectangle, `margin` inside its border."""
    inside_x = x[0] + margin <= place[0] <= x[1] - margin
    return inside_x and y[0] + margin <= place[1] <= y[1] - margin


def cm(place: Place) -> str:
    """A position as text, in centimetres."""
    return f"({place[0] * 100:.1f}, {place[1] * 100:.1f}) cm".replace("-", "−")


class ApplicationOptions(OldNames):
    """What both have. Positions in m; times in s.

    Attributes:
        grasp_z: Height at which a standing object is grasped.
        attempts: Attempts to move an object before the robot asks a person for help.
        ask_again_s: Time without an answer after which a request to a person is repeated.
        arming_timeout_s: The application ends when the arm is not armed again for so long.
        frame: Frame of all positions.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    old_names: ClassVar[tuple[tuple[str, str], ...]] = (("arm_patience_s", "arming_timeout_s"),)

    grasp_z: float
    attempts: int = Field(3, ge=1)
    ask_again_s: float = Field(25.0, gt=0)
    arming_timeout_s: float = Field(10.0, gt=0)
    frame: str


class RuleLearnerOptions(ApplicationOptions):
    """Positions in m; times in s.

    Attributes:
        objects: Names (colours) of the objects.
        corners: Where the robot places an object to learn how the camera sees its working area.
        offer: Where the open hand waits for an object: x, y, and height of the gripper.
        start: Marked position at which a person stands an object, for a hand that is not given one; goes first.
        surface_x, surface_y: Range of the working surface: an object that vanishes outside was carried away.
        pointing: How the object pointed at is recognised: by "nearness" of the hand, or by the target of an arm tracked
            in "action_space".
        settle_s: Time from when the arm has left until the view of an object counts.
    """

    objects: tuple[str, ...] = ("yellow", "green", "blue")
    corners: tuple[Place, ...]
    offer: tuple[float, float, float] | None = None
    start: Place | None = None
    surface_x: Range
    surface_y: Range
    pointing: Pointing = "nearness"
    settle_s: float = Field(2.6, ge=0)

    @model_validator(mode="after")
    def _gets_its_first_object(self) -> Self:
        if self.offer is None and self.start is None:
            raise ValueError("neither offer nor start: give one of them, where a person brings the first object")
        return self

    def on_surface(self, place: Place, margin: float = 0.0) -> bool:
        """Whether a position lies on the surface, `margin` inside its border."""
        return within(place, self.surface_x, self.surface_y, margin)


class RelocatorOptions(ApplicationOptions):
    """Positions in m; times in s.

    Attributes:
        object_name: Name of the object.
        start: Where the object stands at first and after a person has helped.
        hold: Where the robot holds it while it waits: out of the person's path, and reached without turning the elbow.
        area_x, area_y: Working area; a target outside is rejected.
        standing: Positions of other objects, which are not moved.
        min_gap: Minimum distance between the centres of two objects.
        places: Number of targets in a run.
        aligns: Whether the person first points at the object, whose position is known. The tracker's offset from it is
            subtracted from every target: it comes from small errors in the measured person and cameras.
        max_offset: Maximum of this offset; a person who points farther away does not point at the object.
        min_certainty: Minimum certainty of a target, 0 to 1; below, the robot asks again. 0.85: deviation of 1.5 cm.
        hand_away: The person's hand has left when it is this far from the target.
        hand_away_s: And has been for this time.
    """

    old_names = (
        *ApplicationOptions.old_names,
        ("patience_s", "ask_again_s"),
        ("least_gap", "min_gap"),
        ("most_offset", "max_offset"),
        ("least_certainty", "min_certainty"),
    )

    object_name: str = "yellow"
    start: Place
    hold: tuple[float, float, float]
    area_x: Range
    area_y: Range
    standing: tuple[Place, ...] = ()
    min_gap: float = Field(0.05, ge=0)
    places: int = Field(3, ge=1, le=1000)
    aligns: bool = True
    max_offset: float = Field(0.035, gt=0)
    min_certainty: float = Field(0.85, ge=0, le=1)
    hand_away: float = Field(0.08, gt=0)
    hand_away_s: float = Field(0.3, ge=0)
