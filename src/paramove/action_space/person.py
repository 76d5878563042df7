"""A person: measures of the arm, where the person sits, and the file of both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from ruamel.yaml import YAML

from paramove.cameras import measured_file
from paramove.demonstrations import RESTING_SHOULDER, ArmLengths
from paramove.documents import Floats, InputError, findings, read_document, replacing
from paramove.observation import ArmSizes

SCALES = (0.3, 2.0)
"""Arm lengths relative to the demonstrator's: from a small humanoid robot to more than any person. Lengths in mm are
far outside."""


@dataclass(frozen=True)
class PersonPlacement:
    """A similarity about the resting shoulder (thesis 6.4.1, where persons and models differ in position only).

    World and model have the same directions: x forward, y left, z up, m.

    Attributes:
        shoulder: the person's resting shoulder in the world, m.
        scale: arm length of the person divided by that of the demonstrator.
    """

    shoulder: tuple[float, float, float] = tuple(map(float, RESTING_SHOULDER))  # type: ignore[assignment]
    scale: float = 1.0

    def __post_init__(self) -> None:
        """Raises InputError for a position that is not finite or a scale out of range."""
        if len(self.shoulder) != 3 or not np.isfinite(self.shoulder).all():
            raise InputError(f"expected three finite coordinates of the shoulder in m, found {self.shoulder}")
        if not SCALES[0] <= self.scale <= SCALES[1]:
            raise InputError(
                f"an arm is {SCALES[0]} to {SCALES[1]} times as long as the demonstrator's, found {self.scale:.3g}; "
                "lengths are in m"
            )

    @classmethod
    def of_arm(cls, shoulder: ArrayLike, arm_length: float) -> PersonPlacement:
        """From the resting shoulder (3,) and the length from shoulder to finger tip of the stretched arm, both in m."""
        x, y, z = np.asarray(shoulder, dtype=np.float64)
        usual = ArmLengths()
        return cls((float(x), float(y), float(z)), arm_length / (usual.upper_arm + usual.forearm + usual.fingertip))

    def in_world(self, points: Floats) -> Floats:
        """Points (..., 3 n), stacked or single, of the models' frame in the world."""
        stacked = points.reshape(*points.shape[:-1], -1, 3)
        placed = np.asarray(self.shoulder) + self.scale * (stacked - RESTING_SHOULDER)
        return np.asarray(placed.reshape(points.shape))

    def in_model(self, points: Floats) -> Floats:
        """Points (..., 3 n) of the world in the models' frame; the inverse of `in_world`."""
        stacked = points.reshape(*points.shape[:-1], -1, 3)
        placed = RESTING_SHOULDER + (stacked - np.asarray(self.shoulder)) / self.scale
        return np.asarray(placed.reshape(points.shape))


class Person(BaseModel):
    """A person's measures, m, as a file holds them.

    Attributes:
        shoulder: The resting right shoulder in the frame of the table.
        upper_arm: Shoulder to elbow.
        forearm: Elbow to wrist.
        hand: Wrist to the tip of the index finger.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    shoulder: tuple[float, float, float] = PersonPlacement().shoulder
    upper_arm: float = Field(default=ArmSizes.upper_arm, gt=0.07, lt=0.6)
    forearm: float = Field(default=ArmSizes.forearm, gt=0.07, lt=0.5)
    hand: float = Field(default=ArmSizes.hand, gt=0.04, lt=0.4)

    @property
    def sizes(self) -> ArmSizes:
        """Of the arm; its thickness grows with its length."""
        default = ArmSizes()
        scaled = default.scaled((self.upper_arm + self.forearm + self.hand) / default.length)
        return replace(scaled, upper_arm=self.upper_arm, forearm=self.forearm, hand=self.hand)

    @property
    def placement(self) -> PersonPlacement:
        """Where the person sits, and how large the person is."""
        return PersonPlacement.of_arm(self.shoulder, self.sizes.length)


def read_person(path: Path) -> Person:
    """The person of a YAML file. Raises InputError if it is missing or invalid."""
    example = "shoulder: [-0.27, -0.18, 0.35], upper_arm: 0.28, forearm: 0.24, hand: 0.17, all in m"
    try:
        remedy = f"`paramove webcam person` writes it; it holds a person's measures, such as {example}"
        return Person.model_validate(read_document(path, "file of a person", remedy=remedy).data)
    except ValidationError as error:
        raise InputError(f"{path}: {findings(error)}; expected for example {example}") from error


def write_person(path: Path, person: Person, decimals: int = 3) -> None:
    """Writes the file that `read_person` reads, rounded to so many decimals of a metre. Raises OSError."""
    content: dict[str, object] = {"shoulder": [round(float(value), decimals) for value in person.shoulder]}
    for name in ("upper_arm", "forearm", "hand"):
        content[name] = round(float(getattr(person, name)), decimals)
    with replacing(path) as unfinished, unfinished.open("w", encoding="utf-8") as file:
        YAML().dump(content, file)


def measured_person(run_folder: Path, path: Path | None) -> Person:
    """The person of a file, looked for in the run's folder first; without one, the synthetic demonstrator."""
    return Person() if path is None else read_person(measured_file(run_folder, path))
