"""The world of relocation by pointing, without pictures: where the object stands, and that a person can put it back."""

import numpy as np

from paramove.msgs.rule_pb2 import Speech
from sim import tool_box
from sim.place_instructor import OBJECT
from sim.places import START
from sim.small_person import shoulder_from_table
from tests.sim.conftest import simulated


def test_the_object_stands_at_its_start_and_is_stood_there_again_by_the_person():
    simulation = simulated("relocate_by_pointing", 3)
    world = simulation.world
    simulation.run_to_tick(15)
    np.testing.assert_allclose(world.position(OBJECT), tool_box.standing_centre(*START), rtol=0, atol=1e-4)
    world.place(OBJECT, tool_box.standing_centre(0.18, 0.05))
    simulation.person.handle(Speech.REQUEST_HELP, OBJECT)
    tick = 15
    while simulation.person.busy and tick < 15 * 40:
        tick += 1
        simulation.run_to_tick(tick)
    assert not simulation.person.busy
    np.testing.assert_allclose(world.position(OBJECT)[:2], START, rtol=0, atol=0.002)
    assert world.axis(OBJECT)[2] > 0.999
    assert world.contacts.unwanted == 0


def test_the_truth_tells_where_the_table_frame_is():
    simulation = simulated("relocate_by_pointing", 0)
    pose = np.array(simulation.layout().world_from_table).reshape(4, 4)
    points = np.random.default_rng(0).normal(size=(4, 3))
    in_world = points @ pose[:3, :3].T + pose[:3, 3]
    expected = shoulder_from_table(points) + simulation.world.world_from_shoulder
    np.testing.assert_allclose(in_world, expected, rtol=0, atol=1e-12)
