"""The truth of a simulated world as messages, in the world frame. For the judge and for tests alone."""

from __future__ import annotations

import numpy as np

from paramove.msgs.truth_pb2 import TruthBody, TruthLayout, TruthState
from sim import tool_box
from sim.simulation import Simulation


def layout(simulation: Simulation) -> TruthLayout:
    """What does not change in a run."""
    looks, origin = simulation.looks, simulation.world.world_from_shoulder
    camera = looks.camera
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3] = camera.shoulder_from_optical.T
    camera_from_world[:3, 3] = -camera.shoulder_from_optical.T @ (camera.position + origin)
    message = TruthLayout(
        seed=looks.seed,
        world_from_shoulder=origin.tolist(),
        camera_from_world=camera_from_world.ravel().tolist(),
        camera_intrinsics=[camera.focal_px, camera.focal_px, *camera.principal_point_px, camera.k1],
        surface_z=tool_box.SURFACE_Z + origin[2],
        light_levels=looks.brightness,
        pixel_noise=looks.pixel_noise,
    )
    if simulation.world_from_table is not None:
        message.world_from_table.extend(simulation.world_from_table.ravel().tolist())
    for item in tool_box.OPENINGS:
        x, y, _ = item.centre + origin
        message.openings.add(name=item.name, x=x, y=y, radius=looks.measures.opening_radius)
    for colour, opening in looks.rules.items():
        message.rules.add(object=colour, opening=opening)
    return message


def state(simulation: Simulation) -> TruthState:
    """What is so now."""
    world, instructor = simulation.world, simulation.instructor
    contacts = world.contacts
    gripper, _ = world.gripper()
    message = TruthState(
        time_ns=simulation.now_ns,
        gripper=(gripper + world.world_from_shoulder).tolist(),
        gripper_commanded=commanded_gripper(simulation).tolist(),
        joint_positions=world.joint_positions().tolist(),
        unwanted_contacts=contacts.unwanted,
        deepest_penetration_mm=1e3 * contacts.deepest,
        contacts=world.contact_names(),
        instructor=instructor.doing,
    )
    for colour in tool_box.COLOURS:
        body = _body(simulation, colour)
        body.held_by_instructor = world.held_by_instructor == colour
        body.last_touched_by = world.last_touched_by[colour]
        message.objects.append(body)
    message.hand.CopyFrom(_body(simulation, "hand"))
    return message


def commanded_gripper(simulation: Simulation) -> np.ndarray:
    """Gripper of the frame that the firmware plays, by forward kinematics, [3], world frame."""
    description = simulation.description
    arm = description.arms["right"]
    angles = description.units.to_radians(simulation.stream.target)[arm.indices]
    return np.asarray(arm.kinematics.forward(angles).gripper + simulation.world.world_from_shoulder)


def _body(simulation: Simulation, name: str) -> TruthBody:
    world = simulation.world
    x, y, z = world.position(name) + world.world_from_shoulder
    quaternion = world.quaternion(name)
    return TruthBody(name=name, x=x, y=y, z=z, quaternion_xyzw=quaternion[[1, 2, 3, 0]].tolist())
