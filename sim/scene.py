"""Builds the MuJoCo model: the robot at its tool box, three objects, the instructor's hand, lights and cameras.

World frame: the torso frame of the robot's model. The files of the robot are taken as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats
from paramove.robots import RobotDescription
from paramove.workspace import Workspace
from sim import looks, opening, places, tool_box
from sim.looks import Looks
from sim.mount import Mount

HOAP3 = Workspace.here().find("robot_description/hoap3")

SOLREF = (0.002, 1.0)  # stiff: nothing sinks in by more than 0.7 mm
SOLIMP = (0.99, 0.999, 0.0003, 0.5, 2.0)
TABLE_FRICTION = (0.25, 0.0005, 0.0001)
ROLLING = 0.0005  # m; of wood on wood, where anything may roll
OBJECT_FRICTION = (0.3, 0.005, 0.0001)
HOLD_SOLREF = (0.02, 1.0)  # the instructor's fingers give about 1 mm per newton

RGBA = {
    "yellow": (0.90, 0.78, 0.05, 1.0),
    "green": (0.08, 0.60, 0.15, 1.0),
    "blue": (0.08, 0.18, 0.75, 1.0),
    "hand": (0.85, 0.10, 0.60, 1.0),
    "sleeve": (0.72, 0.72, 0.74, 1.0),
    "table": (0.70, 0.68, 0.64, 1.0),
    "box": (0.56, 0.55, 0.53, 1.0),
    "lining": (0.13, 0.13, 0.13, 1.0),
}
FLOOR = ((0.66, 0.66, 0.67), (0.57, 0.57, 0.58))
"""Colours of its tiles."""
FAR_EDGE = 0.60
"""Of the table, where the person sits; frame of the tool box's measures, m."""
HAND = "person_hand"
"""Body of the person's hand; robots have hands, too."""
HIDDEN_GROUP = 3
SLEEVE_GROUP = 1
"""Of the sleeve of a person of whom one sees a hand alone."""
MARGIN_SHARE = 16 / 240  # rendered beyond each border, which the lens may pull in
RENDERED_PX = (
    looks.WIDTH_PX + 2 * round(looks.WIDTH_PX / 2 * MARGIN_SHARE),
    looks.HEIGHT_PX + 2 * round(looks.HEIGHT_PX / 2 * MARGIN_SHARE),
)
VIEW_PX = (640, 480)

NOMINAL_LIGHT = 0.36  # of each light at brightness 1
AMBIENT_SHARE = 0.35
LIGHT_PLACES = ((0.5, 0.9, 1.4), (0.7, -1.0, 1.3))


Furnish = Callable[[mujoco.MjSpec, Floats], None]
"""Adds more to a world, which it is given with the place of the right shoulder in it, [3], m."""


def build(
    world_looks: Looks, robot: RobotDescription, furnishings: Sequence[Furnish] = ()
) -> tuple[mujoco.MjModel, Mount]:
    """The compiled model of a seed's world, and how the robot stands in it."""
    spec = mujoco.MjSpec.from_file(str(robot.model_path))
    mount = Mount.of(robot, spec)
    _set_options(spec)
    world_from_shoulder = mount.origin
    mount.add_stand(spec, RGBA["table"])
    _add_lights(spec, world_looks.brightness)
    _add_surroundings(spec, world_from_shoulder, mount.table_edge)
    _add_box(spec, world_from_shoulder, world_looks.measures)
    shapes = world_looks.measures.shapes(mount.object_width)
    _add_objects(spec, world_from_shoulder, shapes)
    _add_hand(spec, world_from_shoulder)
    _add_cameras(spec, world_looks, world_from_shoulder)
    for furnish in furnishings:
        furnish(spec, world_from_shoulder)
    model = spec.compile()
    if any(shape.kind == "lying" for shape in shapes.values()):
        slow_rolling(model)
    return model, mount


def slow_rolling(model: mujoco.MjModel) -> None:
    """Surfaces, which have a priority, slow down what rolls on them."""
    surfaces = model.geom_priority == touchable()["priority"]
    model.geom_condim[surfaces], model.geom_friction[surfaces, 2] = 6, ROLLING


def _set_options(spec: mujoco.MjSpec) -> None:
    option = spec.option
    option.timestep = 0.001
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0
    option.iterations = 60
    # With the automatic reset, a state that is not finite would silently become the zero pose.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    visual = spec.visual
    visual.global_.offwidth = max(RENDERED_PX[0], VIEW_PX[0])
    visual.global_.offheight = max(RENDERED_PX[1], VIEW_PX[1])
    visual.quality.offsamples = 0  # multisampling costs more than it gives: the tracker measures softly anyway
    visual.quality.shadowsize = 0
    visual.quality.numslices = 16
    visual.quality.numstacks = 10
    visual.map.znear = 0.02
    visual.map.zfar = 8.0
    spec.stat.extent = 1.0
    spec.stat.center = (0.1, -0.1, 0.0)


def _add_lights(spec: mujoco.MjSpec, brightness: tuple[float, float]) -> None:
    ambient = AMBIENT_SHARE * NOMINAL_LIGHT * sum(brightness) / 2
    spec.visual.headlight.ambient = (ambient,) * 3
    spec.visual.headlight.diffuse = (0.0, 0.0, 0.0)
    spec.visual.headlight.specular = (0.0, 0.0, 0.0)
    for number, (level, place) in enumerate(zip(brightness, LIGHT_PLACES, strict=True)):
        shine = NOMINAL_LIGHT * level
        spec.worldbody.add_light(
            name=f"light_{number}",
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=place,
            dir=-np.array(place),
            diffuse=(shine,) * 3,
            specular=(0.3 * shine,) * 3,
            ambient=(0.0, 0.0, 0.0),
            castshadow=False,
        )


def touchable(**more: Any) -> dict[str, Any]:
    """A surface that decides how it is touched: MuJoCo takes the larger of two frictions unless one has priority."""
    return {
        "friction": TABLE_FRICTION,
        "solref": SOLREF,
        "solimp": SOLIMP,
        "condim": 4,
        "priority": 1,
        **more,
    }


def _add_surroundings(spec: mujoco.MjSpec, world_from_shoulder: Floats, near_edge: float) -> None:
    thickness, half_width = 0.02, 0.80
    edges = world_from_shoulder[0] + np.array((near_edge, FAR_EDGE))
    table_z = world_from_shoulder[2] + tool_box.TABLE_Z
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=(edges.mean(), 0.0, table_z - thickness / 2),
        size=(np.ptp(edges) / 2, half_width, thickness / 2),
        rgba=RGBA["table"],
        **touchable(),
    )
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.80, 0.82, 0.84),
        rgb2=(0.60, 0.61, 0.63),
        width=32,
        height=192,
    )
    spec.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=FLOOR[0],
        rgb2=FLOOR[1],
        width=64,
        height=64,
    )
    tiles = spec.add_material(name="floor", texrepeat=(5.0, 5.0), texuniform=True)
    tiles.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    spec.worldbody.add_geom(  # the robot hangs above it; what falls off the table stays on it
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(0.0, 0.0, -0.36),
        size=(3.0, 3.0, 0.1),
        material="floor",
        **touchable(),
    )


def _add_box(spec: mujoco.MjSpec, world_from_shoulder: Floats, measures: tool_box.Measures) -> None:
    """The tool box, openings up. The instructor turns it, so it is moved from outside (mocap)."""
    body = spec.worldbody.add_body(name="box", mocap=True, pos=world_from_shoulder + tool_box.CENTRE)
    centre = np.array(tool_box.CENTRE)
    hx, hy, hz = tool_box.HALF_SIZE
    places_in_box = [item.centre - centre for item in tool_box.OPENINGS]
    half = opening.TILE_HALF
    shape = (measures.opening_radius, measures.chamfer)
    pieces = opening.wedges(*shape, tool_box.COMPARTMENT_DEPTH)
    for number, piece in enumerate(pieces):
        spec.add_mesh(name=f"wedge_{number}", uservert=piece.ravel())
        for item, place in zip(tool_box.OPENINGS, places_in_box, strict=True):
            body.add_geom(
                name=f"{item.name}_{number}",
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=f"wedge_{number}",
                pos=place,
                group=HIDDEN_GROUP,
                **touchable(),
            )
    row_x = float(places_in_box[0][0])
    top, low = hz, hz - tool_box.COMPARTMENT_DEPTH
    _add_block(body, "box_near", (-hx, row_x - half), (-hy, hy), (low, top))
    _add_block(body, "box_far", (row_x + half, hx), (-hy, hy), (low, top))
    _add_block(body, "box_floor", (-hx, hx), (-hy, hy), (-hz, low))
    edge = -hy
    for number, place in enumerate([*places_in_box, np.array((0.0, hy + half, 0.0))]):
        _add_block(body, f"box_gap_{number}", (row_x - half, row_x + half), (edge, place[1] - half), (low, top))
        edge = place[1] + half
    _add_box_surfaces(spec, body, places_in_box, shape)


def _add_block(body: Any, name: str, x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> None:
    ends = np.array((x, y, z))
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=ends.mean(axis=1),
        size=(ends[:, 1] - ends[:, 0]) / 2,
        group=HIDDEN_GROUP,
        **touchable(),
    )


def _add_box_surfaces(spec: mujoco.MjSpec, body: Any, places_in_box: list[Floats], shape: tuple[float, float]) -> None:
    centres = np.array(places_in_box)[:, :2]
    vertices, triangles = opening.cover(tool_box.HALF_SIZE, centres, *shape)
    _add_surface(spec, body, "box_cover", vertices, triangles, (0.0, 0.0, 0.0), "box")
    vertices, triangles = opening.lining(*shape, tool_box.COMPARTMENT_DEPTH)
    for number, place in enumerate(places_in_box):
        _add_surface(spec, body, f"lining_{number}", vertices, triangles, place, "lining")


def _add_surface(
    spec: mujoco.MjSpec, body: Any, name: str, vertices: Floats, triangles: NDArray[np.int32], place: Any, look: str
) -> None:
    """A visible body without contacts."""
    spec.add_mesh(
        name=name,
        uservert=vertices.ravel(),
        userface=triangles.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        pos=place,
        rgba=RGBA[look],
        contype=0,
        conaffinity=0,
        mass=0.0,
    )


def _add_objects(spec: mujoco.MjSpec, world_from_shoulder: Floats, shapes: Mapping[str, tool_box.Shape]) -> None:
    for (colour, shape), place in zip(shapes.items(), places.PARKED, strict=True):
        kind, size = mujoco.mjtGeom.mjGEOM_CYLINDER, (shape.half_width, shape.half_height, 0.0)
        turn = (1.0, 0.0, 0.0, 0.0)
        if shape.kind == "block":
            kind, size = mujoco.mjtGeom.mjGEOM_BOX, (shape.half_width, shape.half_width, shape.half_height)
        elif shape.kind == "lying":
            size, turn = (shape.half_height, shape.half_width, 0.0), (0.5**0.5, 0.0, 0.5**0.5, 0.0)
        wider = shape.half_width / tool_box.CYLINDER_RADIUS
        taller = shape.half_height / tool_box.CYLINDER_HALF_HEIGHT
        body = spec.worldbody.add_body(name=colour, pos=world_from_shoulder + place)
        body.add_freejoint(name=colour)
        body.add_geom(
            name=colour,
            type=kind,
            size=size,
            quat=turn,
            mass=tool_box.CYLINDER_MASS * wider**2 * taller,
            rgba=RGBA[colour],
            friction=OBJECT_FRICTION,
            solref=SOLREF,
            solimp=SOLIMP,
            condim=4,
        )


def _add_hand(spec: mujoco.MjSpec, world_from_shoulder: Floats) -> None:
    """The instructor's hand, which touches nothing. Origin: tip of the pointing finger; z from there to the wrist."""
    body = spec.worldbody.add_body(name=HAND, mocap=True, pos=world_from_shoulder + places.IDLE_FINGERTIP)
    capsule, ellipsoid = mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_ELLIPSOID
    looks_only = {"contype": 0, "conaffinity": 0, "mass": 0.0}
    parts = (
        ("finger", (0.0, 0.0, 0.0075), (0.0, 0.0, 0.050), 0.0075, "hand"),
        ("thumb", (0.012, -0.014, 0.032), (0.006, -0.012, 0.062), 0.0075, "hand"),
        ("knuckle", (-0.004, 0.014, 0.040), (-0.004, 0.012, 0.062), 0.0085, "hand"),
        ("sleeve", (0.0, 0.0, 0.135), (0.0, 0.0, 0.480), 0.019, "sleeve"),
    )
    for name, start, end, radius, look in parts:
        body.add_geom(
            name=f"hand_{name}",
            type=capsule,
            fromto=(*start, *end),
            size=(radius, 0.0, 0.0),
            rgba=RGBA[look],
            group=SLEEVE_GROUP if name == "sleeve" else 0,
            **looks_only,
        )
    body.add_geom(
        name="hand_palm", type=ellipsoid, pos=(0.0, 0.0, 0.080), size=(0.015, 0.025, 0.040), rgba=RGBA["hand"],
        **looks_only,
    )  # fmt: skip
    for colour in tool_box.COLOURS:
        weld = spec.add_equality(
            name=f"hold_{colour}",
            type=mujoco.mjtEq.mjEQ_WELD,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            name1=HAND,
            name2=colour,
            active=False,
            solref=HOLD_SOLREF,
        )
        weld.data[10] = 1.0  # torque scale


def _add_cameras(spec: mujoco.MjSpec, world_looks: Looks, world_from_shoulder: Floats) -> None:
    camera = world_looks.camera
    flip = np.diag((1.0, -1.0, -1.0))  # MuJoCo's camera looks along -z with y up
    spec.worldbody.add_camera(
        name="camera",
        pos=world_from_shoulder + camera.position,
        quat=quaternion_of(camera.shoulder_from_optical @ flip),
        fovy=float(np.rad2deg(2 * np.arctan(RENDERED_PX[1] / 2 / camera.focal_px))),
    )
    place_view(spec, (0.30, 1.32, 0.68), (0.30, -0.15, 0.10))


def place_view(spec: mujoco.MjSpec, eye: Any, target: Any) -> None:
    """The view for people is from `eye` to `target`, both [3], m, world."""
    backward = (np.array(eye) - np.array(target)) / np.linalg.norm(np.array(eye) - np.array(target))
    right = np.cross((0.0, 0.0, 1.0), backward)
    right /= np.linalg.norm(right)
    turned = quaternion_of(np.column_stack((right, np.cross(backward, right), backward)))
    view = spec.camera("view")
    if view is None:
        view = spec.worldbody.add_camera(name="view", fovy=42.0)
    view.pos, view.quat = eye, turned


def quaternion_of(rotation: Floats) -> Floats:
    """Unit quaternion (w, x, y, z) of a rotation matrix [3, 3]."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).ravel())
    return quaternion
