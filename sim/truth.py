"""The truth of a simulated world as messages, in the world frame. For the judge and for tests alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paramove.documents import Floats
from paramove.msgs.truth_pb2 import TruthArm, TruthBody, TruthLayout, TruthState
from sim import tool_box
from sim.arm import ELBOW, SHOULDER, TIP, Arm
from sim.looks import Looks
from sim.person import Person
from sim.scene import HAND
from sim.small_person import table_from_shoulder
from sim.world import World

if TYPE_CHECKING:
    from sim.simulation import SimulatedRobot


def layout(looks: Looks, world: World, world_from_table: Floats | None) -> TruthLayout:
    """What does not change in a run."""
    camera, origin = looks.camera, world.world_from_shoulder
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3] = camera.shoulder_from_optical.T
    camera_from_world[:3, 3] = -camera.shoulder_from_optical.T @ (camera.position + origin)
    message = TruthLayout(
        seed=looks.seed,
        world_from_shoulder=world.mount.base.tolist(),
        camera_from_world=camera_from_world.ravel().tolist(),
        camera_intrinsics=[camera.focal_px, camera.focal_px, *camera.principal_point_px, camera.k1],
        surface_z=tool_box.SURFACE_Z + origin[2],
        light_levels=looks.brightness,
        pixel_noise=looks.pixel_noise,
    )
    if world_from_table is not None:
        message.world_from_table.extend(world_from_table.ravel().tolist())
    for item in tool_box.OPENINGS:
        x, y, _ = item.centre + origin
        message.openings.add(name=item.name, x=x, y=y, radius=looks.measures.opening_radius)
    for colour, opening in looks.rules.items():
        message.rules.add(object=colour, opening=opening)
    for colour, shape in world.shapes.items():
        message.objects.add(name=colour, width=2 * shape.half_width, height=2 * shape.half_height)
    return message


def state(now_ns: int, world: World, robot: SimulatedRobot, person: Person) -> TruthState:
    """What is so now; where the commanded gripper is not known, it is the true one."""
    contacts, origin = world.contacts, world.world_from_shoulder
    gripper, _ = world.gripper()
    commanded = robot.commanded_gripper()
    message = TruthState(
        time_ns=now_ns,
        gripper=(gripper + origin).tolist(),
        gripper_commanded=((gripper if commanded is None else commanded) + origin).tolist(),
        joint_positions=world.joint_positions().tolist(),
        unwanted_contacts=contacts.unwanted,
        deepest_penetration_mm=1e3 * contacts.deepest,
        contacts=world.contact_names(),
        instructor=person.doing,
    )
    for colour in tool_box.COLOURS:
        body = _body(world, colour)
        body.held_by_instructor = world.held_by_instructor == colour
        body.last_touched_by = world.last_touched_by[colour]
        message.objects.append(body)
    message.hand.CopyFrom(_body(world, HAND))
    message.hand.name = "hand"
    return message


def arm(now_ns: int, person: Arm) -> TruthArm:
    """How a person's arm is and where it points, in the table frame."""
    message = TruthArm(time_ns=now_ns)
    points = table_from_shoulder(person.posture[[SHOULDER, ELBOW, TIP]])
    for name, (x, y, z) in zip(("shoulder", "elbow", "hand"), points, strict=True):
        message.points.add(name=name, x=x, y=y, z=z)
    if person.target is not None:
        message.action, message.performance = "pointing", person.pointings
        message.target.x, message.target.y, message.target.z = table_from_shoulder(person.target)
        message.at_target = person.at_target
    return message


def _body(world: World, name: str) -> TruthBody:
    x, y, z = world.position(name) + world.world_from_shoulder
    quaternion = world.quaternion(name)
    return TruthBody(name=name, x=x, y=y, z=z, quaternion_xyzw=quaternion[[1, 2, 3, 0]].tolist())
