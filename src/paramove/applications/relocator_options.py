"""Places and timeouts of relocation by pointing, as parameters of its process."""

from __future__ import annotations

from pydantic import ConfigDict, Field

from paramove.applications.stage import Place
from paramove.applications.table import Surface
from paramove.documents import OldNames

Range = tuple[float, float]


class RelocatorOptions(OldNames):
    """Places in the right shoulder's frame, m; times in s.

    Attributes:
        object_name: As it is called.
        start: Where the object stands at first, and after somebody has helped.
        hold: Where the robot holds it while it waits: beside the person's way, and where the elbow need not turn aside.
        grasp_z: Height at which a standing object is grasped.
        area_x, area_y: Working area; a place outside is not taken.
        standing: Places of other objects, which stay where they are.
        min_gap: Between the middles of two objects.
        places: How many places are pointed at.
        aligns: Whether the person first points at the object, whose place is known. As far beside it as the tracker
            finds that, it finds every place: person and cameras are measured a little wrong.
        max_offset: A person who points farther beside the object does not point at it.
        min_certainty: Of a place, 0 to 1; for a less certain one the robot asks again. 0.85 is a deviation of 1.5 cm.
        hand_away: The person's hand has left when it is so far from the place pointed at.
        hand_away_s: And has been for so long.
        attempts: How often in a row an object is tried to be fetched before the person is asked.
        ask_again_s: A request is repeated after so long.
        arming_timeout_s: The application ends when the arm is not armed again for so long.
        frame: Of all places.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    old_names = (
        ("patience_s", "ask_again_s"),
        ("arm_patience_s", "arming_timeout_s"),
        ("least_gap", "min_gap"),
        ("most_offset", "max_offset"),
        ("least_certainty", "min_certainty"),
    )

    object_name: str = "yellow"
    start: Place = (0.165, -0.02)
    hold: tuple[float, float, float] = (0.13, -0.12, -0.045)
    grasp_z: float = -0.098
    area_x: Range = (0.125, 0.19)
    area_y: Range = (-0.105, 0.07)
    standing: tuple[Place, ...] = ()
    min_gap: float = Field(0.05, ge=0)
    places: int = Field(3, ge=1, le=1000)
    aligns: bool = True
    max_offset: float = Field(0.035, gt=0)
    min_certainty: float = Field(0.85, ge=0, le=1)
    hand_away: float = Field(0.08, gt=0)
    hand_away_s: float = Field(0.3, ge=0)
    attempts: int = Field(3, ge=1)
    ask_again_s: float = Field(25.0, gt=0)
    arming_timeout_s: float = Field(10.0, gt=0)
    frame: str = "right_shoulder"

    @property
    def area(self) -> Surface:
        """The working area."""
        return Surface(self.area_x, self.area_y)
