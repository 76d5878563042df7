"""The lowest point of every kind of shape, compared with MuJoCo's distance from a box far below."""

import mujoco
import numpy as np
import pytest

from paramove.motion.lowest_point import LowestPoint

SHAPES = {
    "box": 'type="box" size="0.05 0.02 0.01"',
    "cylinder": 'type="cylinder" size="0.02 0.06"',
    "capsule": 'type="capsule" fromto="-0.06 0 0.03 0.06 0 0.03" size="0.015"',
    "sphere": 'type="sphere" size="0.03"',
    "ellipsoid": 'type="ellipsoid" size="0.06 0.03 0.01"',
    "mesh": 'type="mesh" mesh="wedge"',
}
WEDGE = "0 0 0  .2 0 0  0 .05 0  0 0 .03  .02 .01 .005"
"""The last vertex is inside of the hull of the others."""
FLOOR_M = 0.5
"""Depth of the upper face of the box below."""


@pytest.mark.parametrize("kind", SHAPES)
def test_the_lowest_point_of_a_shape_is_exact(kind: str) -> None:
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="wedge" vertex="{WEDGE}"/></asset><worldbody>'
        f'<geom name="floor" type="box" pos="0 0 {-FLOOR_M - 1}" size="3 3 1"/>'
        f'<body><freejoint/><geom name="shape" {SHAPES[kind]}/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    floor, shape = model.geom("floor").id, model.geom("shape").id
    lowest = LowestPoint(model, [shape])
    draw = np.random.default_rng(1)
    for _ in range(20):
        turn = draw.normal(size=4)
        data.qpos[:] = [*draw.uniform(-0.2, 0.2, 3), *turn / np.linalg.norm(turn)]
        mujoco.mj_kinematics(model, data)
        distance = mujoco.mj_geomDistance(model, data, shape, floor, 2.0, None)
        assert lowest.height(data) == pytest.approx(distance - FLOOR_M, abs=2e-5)


def test_of_several_shapes_the_lowest_counts() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom type="sphere" size="0.1"/><geom type="capsule" size="0.1 0.2" pos="1 0 0"/>'
        '<geom type="box" size="0.1 0.1 0.25" pos="2 0 0"/></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert LowestPoint(model, [0, 1, 2]).height(data) == pytest.approx(-0.3)
    assert LowestPoint(model, [0, 2]).height(data) == pytest.approx(-0.25)
