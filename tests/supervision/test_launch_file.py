"""Launch files: what is read, what is refused, and where the error points."""

import contextlib
import textwrap

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.documents.positions import DocumentError, read_mapping
from paramove.supervision import launch_file
from paramove.supervision.launch_file import LaunchFileMissingError, validated
from paramove.supervision.stopping import start_waves, stop_waves
from paramove.workspace import Workspace

GOOD = """\
description: Two nodes
default_overlays: [slow]
seed_parameters: [world.seed]
nodes:
  camera: {module: nodes.camera, parameters: {rate_hz: 15, lens: {k1: 0.1, k2: 0.2}}}
  world:
    module: sim.simulator
    restart: on-failure
    budget: {restarts: 2, window_s: 10}
"""


def load(folder, *arguments, **options):
    return launch_file.load(Workspace(folder.parent, (folder.parent,)), *arguments, **options)


@pytest.fixture
def folder(launches):
    (launches / "overlays").mkdir()
    (launches / "good.yaml").write_text(GOOD)
    (launches / "overlays" / "slow.yaml").write_text("nodes: {camera: {parameters: {rate_hz: 5, lens: {k1: 0.3}}}}\n")
    (launches / "overlays" / "bare.yaml").write_text("nodes: {world: null, extra: {module: nodes.extra}}\n")
    return launches


def parameters(launch):
    return launch.file.nodes["camera"].parameters


def test_default_overlay_merges_parameters(folder):
    assert parameters(load(folder, "good")) == {"rate_hz": 5, "lens": {"k1": 0.3, "k2": 0.2}}


def test_overlays_given_replace_the_default_one_and_may_add_and_remove_nodes(folder):
    (folder / "other.yaml").write_text(GOOD.replace("seed_parameters: [world.seed]\n", ""))
    launch = load(folder, "other", ["bare"])
    assert list(launch.file.nodes) == ["camera", "extra"]
    assert parameters(launch)["rate_hz"] == 15


def test_an_overlay_that_leaves_out_a_node_that_there_is_not_names_the_nearest(folder):
    (folder / "overlays" / "typo.yaml").write_text("nodes: {wrld: null}\n")
    with pytest.raises(DocumentError, match=r"typo\.yaml:1:9: there is no node 'wrld'.* did you mean 'world'"):
        load(folder, "good", ["typo"])


def test_settings_come_last_and_are_yaml(folder):
    launch = load(folder, "good", None, ["camera.rate_hz=7.5", "camera.lens.k2=[1, 2]", "camera.name=left: eye"[:16]])
    assert parameters(launch) == {"rate_hz": 7.5, "lens": {"k1": 0.3, "k2": [1, 2]}, "name": "left"}


def test_remaps_of_the_command_line_come_last(folder):
    remaps = ["camera:camera/image=left/image", "camera:clock=left/clock"]
    launch = load(folder, "good", None, remaps=remaps)
    assert launch.file.nodes["camera"].remaps == {"camera/image": "left/image", "clock": "left/clock"}


@pytest.mark.parametrize("remap", ["camera", "camera:", "camera:a", "camera:a=", ":a=b", "camera:=b"])
def test_a_remap_in_another_form_is_rejected(folder, remap):
    with pytest.raises(DocumentError, match="expected node:topic=topic"):
        load(folder, "good", None, remaps=[remap])


def test_a_remap_of_a_missing_node_names_the_nearest(folder):
    with pytest.raises(DocumentError, match=r"--remap camra:a=b: .*did you mean 'camera'"):
        load(folder, "good", None, remaps=["camra:a=b"])


def test_an_overlay_is_laid_over_those_that_it_names_once_each(folder):
    overlays = folder / "overlays"
    (overlays / "fast.yaml").write_text("over: [slow]\nnodes: {camera: {parameters: {rate_hz: 60}}}\n")
    (overlays / "zoom.yaml").write_text("nodes: {camera: {parameters: {lens: {k1: 0.5}}}}\n")
    (overlays / "faster.yaml").write_text("over: [fast, slow, zoom]\nnodes: {camera: {parameters: {lens: {k2: 9}}}}\n")
    launch = load(folder, "good", ["faster"])
    assert launch.overlays == ("slow", "fast", "zoom", "faster")
    assert parameters(launch) == {"rate_hz": 60, "lens": {"k1": 0.5, "k2": 9}}
    assert load(folder, "good", ["slow", "fast"]).overlays == ("slow", "fast")


@pytest.mark.parametrize(
    ("over", "message"),
    [
        ("[fast]", "'fast' would lie over itself: fast over fast"),
        ("[round]", "round.yaml:1:8: 'fast' would lie over itself: fast over round over fast"),
        ("[slwo]", "there is no overlay 'slwo'"),
        ("[../x]", "expected the plain name of an overlay"),
        ("3", "expected a list of names"),
    ],
)
def test_an_overlay_over_a_wrong_one_is_rejected_with_the_place(folder, over, message):
    (folder / "overlays" / "fast.yaml").write_text(f"over: {over}\n")
    (folder / "overlays" / "round.yaml").write_text("over: [fast]\n")
    with pytest.raises(DocumentError) as error:
        load(folder, "good", ["fast"])
    assert message in str(error.value)


def test_seed_goes_where_the_file_says(folder):
    assert load(folder, "good", seed=7).file.nodes["world"].parameters == {"seed": 7}


def test_topics_are_read_by_the_names_that_they_had_before(folder):
    remaps = "{camera/light: camera_2/light, own/camera/light: a}"
    overlay = f"nodes: {{camera: {{remaps: {remaps}, optional_topics: [camera/light]}}}}"
    (folder / "overlays" / "old.yaml").write_text(overlay)
    with pytest.warns(FutureWarning) as warned:
        launch = load(folder, "good", ["old"], ["camera.source=topic:camera/light"])
    assert launch.file.nodes["camera"].remaps == {"camera/image_raw": "camera_2/image_raw", "own/camera/light": "a"}
    assert launch.file.nodes["camera"].optional_topics == ["camera/image_raw"]
    assert launch.file.nodes["camera"].parameters["source"] == "topic:camera/image_raw"
    assert sorted({str(one.message).split(";")[0] for one in warned}) == [
        "topic camera/light is called camera/image_raw now",
        "topic camera_2/light is called camera_2/image_raw now",
    ]


def test_headless_sets_what_the_file_says_and_settings_win(folder):
    (folder / "seen.yaml").write_text(
        "headless: {a.video: false, a.size: 1}\nnodes: {a: {module: m, parameters: {video: true}}}"
    )
    assert load(folder, "seen").file.nodes["a"].parameters == {"video": True}
    launch = load(folder, "seen", None, ["a.size=3"], headless=True)
    assert launch.file.nodes["a"].parameters == {"video": False, "size": 3}


def test_another_connection_needs_an_overlay_that_says_what_it_is(folder):
    (folder / "arm.yaml").write_text(f"connections: [camera.port]\n{GOOD}")
    for name in ("slow", "real"):
        (folder / "overlays" / f"{name}.yaml").write_text("nodes: {camera: {parameters: {port: /dev/one}}}")
    (folder / "overlays" / "view.yaml").write_text("nodes: {camera: {parameters: {size: 3}}}")
    for overlays in (None, ["view"], []):
        with pytest.raises(DocumentError, match=r"--set camera\.port=/dev/two: .*--with real"):
            load(folder, "arm", overlays, ["camera.port=/dev/two"])
    assert parameters(load(folder, "arm", ["real"], ["camera.port=/dev/two"]))["port"] == "/dev/two"
    assert parameters(load(folder, "arm", None, ["camera.rate_hz=3"]))["port"] == "/dev/one"
    (folder / "wrong.yaml").write_text(f"connections: [camer.port]\n{GOOD}")
    with pytest.raises(DocumentError, match=r"'camer\.port' is not a node\.parameter; did you mean 'camera'"):
        load(folder, "wrong")


def test_a_robot_replaces_those_that_the_files_name(folder):
    robot = "parameters: {robot: koch, x: 1}"
    (folder / "arms.yaml").write_text(
        f"nodes: {{a: {{module: m, {robot}}}, b: {{module: m}}, c: {{module: m, {robot}}}}}"
    )
    launch = load(folder, "arms", settings=["c.robot=other"], robot="px100")
    given = {name: node.parameters for name, node in launch.file.nodes.items()}
    assert given == {"a": {"robot": "px100", "x": 1}, "b": {}, "c": {"robot": "other", "x": 1}}
    (folder / "plain.yaml").write_text("nodes: {a: {module: m}}")
    with pytest.raises(DocumentError, match=r"--robot px100.*no node of this launch file names a robot"):
        load(folder, "plain", robot="px100")


def test_seed_without_a_taker_is_refused(folder):
    (folder / "plain.yaml").write_text("nodes: {a: {module: m}}")
    with pytest.raises(DocumentError, match="has no 'seed_parameters'"):
        load(folder, "plain", seed=7)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("camera", "expected node.parameter=value"),
        ("camera=3", "expected node.parameter=value"),
        ("camer.rate_hz=3", "there is no node 'camer'; did you mean 'camera'?"),
        ("camera.rate_hz=!!python/name:os.system", "tag .* is rejected"),
        ("camera.rate_hz=[1", "it ends before a ']'"),
    ],
)
def test_wrong_setting_is_named(folder, setting, message):
    with pytest.raises(DocumentError, match=message) as caught:
        load(folder, "good", None, [setting])
    assert setting in str(caught.value)


def test_an_overlay_of_this_launch_file_comes_before_one_for_all(folder):
    (folder / "overlays" / "good").mkdir()
    (folder / "overlays" / "good" / "slow.yaml").write_text("nodes: {camera: {parameters: {rate_hz: 2}}}\n")
    assert load(folder, "good").file.nodes["camera"].parameters["rate_hz"] == 2
    (folder / "other.yaml").write_text((folder / "good.yaml").read_text())
    assert load(folder, "other", ["slow"]).file.nodes["camera"].parameters["rate_hz"] == 5


@pytest.mark.parametrize(
    ("name", "overlays", "message"),
    [
        ("god", None, "did you mean 'good'?"),
        ("../good", None, "not a name of a launch file"),
        ("good", ["slo"], "no such overlay; did you mean 'slow'?"),
        ("good; rm -rf /", None, "not a name of a launch file"),
    ],
)
def test_missing_file_is_told_with_the_nearest_name(folder, name, overlays, message):
    with pytest.raises(LaunchFileMissingError) as caught:
        load(folder, name, overlays)
    assert message in str(caught.value)


BAD = [
    ("", "1:1", "the file is empty"),
    ("- nodes", "1:1", "expected a mapping at the top level"),
    ("nodes: {a: {module: m}}\nnode: 3", "2:1", "unknown key 'node'; did you mean 'nodes'?"),
    ("nodes:\n  a: {modul: m}", "2:7", "unknown key 'modul'; did you mean 'module'?"),
    ("nodes:\n  a:\n    parameters: {}", "2:3", "nodes.a.module is missing"),
    ("nodes:\n  a: {module: m, restart: on-failur}", "2:18", "did you mean 'on-failure'?"),
    ("nodes:\n  a: {module: m, required: 'yes'}", "2:18", "nodes.a.required"),
    ("nodes:\n  a: {module: m, budget: {restart: 3}}", "2:27", "did you mean 'restarts'?"),
    ("nodes:\n  a: {module: m, backoff_s: .nan}", "2:29", "numbers are finite"),
    ("nodes:\n  a: {module: m, backoff_s: -1}", "2:18", "greater than or equal to 0"),
    ("nodes:\n  a: {module: 'm; rm -rf /'}", "2:7", "nodes.a.module"),
    ("nodes:\n  a: {module: ../m}", "2:7", "nodes.a.module"),
    ("nodes:\n  A b: {module: m}", "2:3", "expected a name such as my_node"),
    ("nodes:\n  a: {module: m}\n  a: {module: n}", "3:3", "duplicate key"),
    ("nodes:\n  a: {module: m, after: [b]}", "2:26", "'a' is started after 'b', which is not a node; there are: a"),
    (
        "nodes:\n  a: {module: m, after: [b]}\n  b: {module: m, after: [a]}",
        "2:18",
        "wait for each other ('after'): a, b",
    ),
    ("nodes: {}", "1:1", "nodes"),
    ("seed_parameters: [b.seed]\nnodes: {a: {module: m}}", "1:19", "'b.seed' is not a node.parameter"),
    ("nodes: {a: {module: !!python/name:os.system x}}", "1:21", "tag"),
    ("nodes: &x {a: {module: m}}", "1:8", "anchor"),
    ("nodes: {a: {module: m}}\nbus: {<<: {clock: x}}", "2:7", "merge keys"),
    ("%YAML 1.1\n---\nnodes: {}", "2:1", "directives are rejected"),
    ("nodes: [" + "[" * 3000, "1:27", "levels of nesting"),
    ("nodes: {a: {module: m, parameters: {x: 2020-01-01}}}", "1:40", "write it in quotes"),
    ("nodes: {a: {module: m}}\n---\nnodes: {}", "2:1", "single document"),
    ("nodes: {1: {module: m}}", "1:9", "is no string"),
]


@pytest.mark.parametrize(("text", "place", "message"), BAD)
def test_error_points_at_the_place(launches, text, place, message):
    path = launches / "bad.yaml"
    path.write_text(text)
    with pytest.raises(DocumentError) as caught:
        load(launches, "bad")
    assert str(caught.value).startswith(f"{path}:{place}: ")
    assert message in str(caught.value)


def test_error_in_an_overlay_points_into_the_overlay(folder):
    (folder / "overlays" / "slow.yaml").write_text("nodes:\n  camera: {requird: true}\n")
    with pytest.raises(DocumentError, match=r"slow\.yaml:2:12: unknown key 'requird'; did you mean 'required'\?"):
        load(folder, "good")


def test_every_finding_is_told():
    with pytest.raises(DocumentError, match=r"f:1:1: unknown key 'x'.*\nf:2:24: nodes.a.restart: ") as caught:
        validated(read_mapping("x: 1\nnodes: {a: {module: m, restart: 3}}", "f"))
    assert len(str(caught.value).splitlines()) == 2


def test_unreadable_bytes_are_refused(launches):
    (launches / "bad.yaml").write_bytes(b"\xff\xfe\x00nodes")
    with pytest.raises(DocumentError, match="cannot be read"):
        load(launches, "bad")


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.data())
def test_damaged_file_is_refused_or_read_but_never_crashes(data):
    text = GOOD
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text)))
        cut = data.draw(st.integers(0, 5))
        text = (
            text[:at] + data.draw(st.text(":{}[]#&*!|>'\"%@`-?, \n\t0aé\x00\x85\udc00", max_size=4)) + text[at + cut :]
        )
    with contextlib.suppress(DocumentError):  # any other exception fails the test
        validated(read_mapping(text, "damaged.yaml"))


def waves_of(text):
    file = validated(read_mapping(textwrap.dedent(text), "f"))
    return start_waves(file), stop_waves(file)


def test_start_and_stop_waves():
    start, stop = waves_of("""
        nodes:
          arm: {module: m, stop: first, after: [world]}
          world: {module: m}
          eyes: {module: m, after: [world]}
          mind: {module: m, after: [eyes, arm]}
          tape: {module: m, stop: last}
    """)
    assert start == [["world", "tape"], ["arm", "eyes"], ["mind"]]
    assert stop == [["arm"], ["mind"], ["eyes"], ["world"], ["tape"]]


def test_a_missing_overlay_is_told_with_those_of_this_launch_file(folder):
    own = folder / "overlays" / "good"
    own.mkdir(exist_ok=True)
    (own / "emulated.yaml").write_text("nodes: {}\n")
    with pytest.raises(LaunchFileMissingError, match="did you mean 'emulated'"):
        load(folder, "good", ["emulatd"])
    with pytest.raises(LaunchFileMissingError, match=r"there are: .*emulated, slow"):
        load(folder, "good", ["nothing_like_it"])


ARM = """\
description: An arm
bus: {clock: simulated}
default_overlays: [emulated]
seed_parameters: [world.seed]
connections: [driver.port]
external: [relocation/goal]
after_run: paramove.runs.servo_arm
headless: {world.video: false}
needs: {model: {file: "{driver.robot}/model", about: a model, made_by: "paramove train {driver.robot}"}}
nodes:
  driver: {module: nodes.driver, parameters: {robot: koch, port: a}, after: [world]}
  recorder: {module: nodes.recorder}
"""
TWO = """\
include:
  left: {launch: arm}
  right: {launch: arm, robot: other, without: [recorder]}
seed_parameters: [watch.seed]
nodes:
  watch: {module: nodes.watch}
  right_driver: {parameters: {port: b}}
"""


@pytest.fixture
def two_arms(launches):
    (launches / "overlays" / "arm").mkdir(parents=True)
    (launches / "arm.yaml").write_text(ARM)
    (launches / "overlays" / "arm" / "emulated.yaml").write_text("nodes: {world: {module: sim.world}}\n")
    (launches / "overlays" / "arm" / "real.yaml").write_text(
        "seed_parameters: []\nheadless: {world.video: null}\nnodes: {driver: {after: null}}\n"
    )
    (launches / "two.yaml").write_text(TWO)
    return launches


def test_the_nodes_of_an_included_file_get_a_namespace_and_names_that_begin_with_it(two_arms):
    file = load(two_arms, "two").file
    assert {name: node.namespace for name, node in file.nodes.items()} == {
        "left_driver": "left",
        "left_recorder": "left",
        "left_world": "left",
        "right_driver": "right",
        "right_world": "right",
        "watch": "",
    }
    assert file.namespaces == ("left", "right")
    assert file.nodes["left_driver"].after == ["left_world"]
    assert file.nodes["left_driver"].parameters == {"robot": "koch", "port": "a"}
    assert file.nodes["right_driver"].parameters == {"robot": "other", "port": "b"}
    assert file.bus.clock == "simulated"


def test_other_keys_of_an_included_file_name_its_nodes_and_topics(two_arms):
    file = load(two_arms, "two").file
    assert file.seed_parameters == ["left_world.seed", "right_world.seed", "watch.seed"]
    assert file.connections == ["left_driver.port", "right_driver.port"]
    assert file.external == ["left/relocation/goal", "right/relocation/goal"]
    assert file.headless == {"left_world.video": False, "right_world.video": False}
    assert file.after_run_of == dict.fromkeys(("left", "right"), "paramove.runs.servo_arm")
    assert file.after_run is None
    assert file.needs["left_model"].file == "{left_driver.robot}/model"
    assert file.needs["right_model"].made_by == "paramove train {right_driver.robot}"


def test_a_file_that_judges_the_whole_run_takes_the_place_of_those_that_judge_its_parts(two_arms):
    (two_arms / "two.yaml").write_text(f"after_run: paramove.runs.hand_over\n{TWO}")
    file = load(two_arms, "two").file
    assert (file.after_run, file.after_run_of) == ("paramove.runs.hand_over", {})


def test_settings_name_nodes_by_their_full_names(two_arms):
    assert load(two_arms, "two", None, ["left_driver.robot=c"]).file.nodes["left_driver"].parameters["robot"] == "c"


def test_an_overlay_chooses_other_overlays_of_an_included_file(two_arms):
    (two_arms / "overlays" / "two").mkdir()
    (two_arms / "overlays" / "two" / "really.yaml").write_text("include: {left: {overlays: [real]}}\n")
    nodes = load(two_arms, "two", ["really"]).file.nodes
    assert "left_world" not in nodes
    assert "right_world" in nodes


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        ("launch: arm}", "launch: arn}", "two.yaml:2:10", "there is no launch file 'arn'"),
        ("launch: arm}", "launch: ../arm}", "two.yaml:2:10", "expected the plain name of a launch file"),
        ("launch: arm}", "launch: two}", "two.yaml:2:10", "two includes others itself"),
        ("launch: arm}", "launch: arm, overlays: [emulator]}", "two.yaml:2:34", "did you mean 'emulated'?"),
        ("{launch: arm}", "arm", "two.yaml:2:3", "expected a mapping such as"),
        ("launch: arm}", "file: arm}", "two.yaml:2:10", "file"),
        ("left:", "truth:", "two.yaml:2:3", "'truth' is no namespace"),
        ("left:", "le-ft:", "two.yaml:2:3", "'le-ft' is no namespace"),
        ("[recorder]", "[recrder]", "two.yaml:3:48", "arm has no node 'recrder'"),
        ("{parameters: {port: b}}", "{restart: x}", "two.yaml:7:18", "'never', 'on-failure' or 'always'"),
    ],
)
def test_what_is_wrong_with_an_included_file_is_rejected_at_its_place(two_arms, old, new, place, message):
    (two_arms / "two.yaml").write_text(TWO.replace(old, new, 1))
    with pytest.raises(DocumentError) as error:
        load(two_arms, "two")
    assert place in str(error.value)
    assert message in str(error.value)


def test_a_mistake_in_the_included_file_is_reported_there(two_arms):
    (two_arms / "arm.yaml").write_text(ARM.replace("module: nodes.recorder", "modul: nodes.recorder"))
    with pytest.raises(DocumentError, match=r"arm.yaml:12:14: .*'module'"):
        load(two_arms, "two")


def test_two_included_files_cannot_have_different_buses(two_arms):
    (two_arms / "still.yaml").write_text("nodes: {driver: {module: nodes.driver}}\n")
    (two_arms / "two.yaml").write_text(TWO.replace("launch: arm}", "launch: still}", 1))
    with pytest.raises(DocumentError, match="'clock' differs: left monotonic, right simulated"):
        load(two_arms, "two")
    (two_arms / "two.yaml").write_text(TWO.replace("launch: arm}", "launch: still}", 1) + "bus: {clock: monotonic}\n")
    assert load(two_arms, "two").file.bus.clock == "monotonic"
