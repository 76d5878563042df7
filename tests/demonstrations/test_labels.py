"""labels.yaml: what is wrong is told with file, line and column; what people wrote is kept."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.demonstrations.labels import LabelsError, LabelsFile, Segment, append_segments, load_labels, write_labels
from paramove.demonstrations.movement import DemonstrationError
from paramove.documents import name_fault

GOOD = """\
# Anna at the table
parameters: [u, v]   # metres
segments:
  # the first of them
  - {recording: a.mcap, start: 0.5, end: 2, action: reaching, theta: [0.1, 2], subject: 3}
  - recording: b.mcap
    start: 0
    end: 1.25
    action: pointing
    theta: [0, 0]
    side: left
"""


def written(folder, text):
    path = folder / "labels.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_good_labels_are_read(tmp_path):
    labels = load_labels(written(tmp_path, GOOD))
    first, second = labels.file.segments
    assert (first.start, first.end, first.theta, first.subject) == (0.5, 2.0, [0.1, 2.0], "3")
    assert (second.side, second.subject, second.repetition) == ("left", "", 0)
    assert [labels.line(0), labels.line(1)] == [5, 6]


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ("subject: 3", "subjekt: 3", ":5:80: unknown key 'subjekt'; did you mean 'subject'?"),
        ("action: pointing", "aktion: pointing", ":9:5: unknown key 'aktion'; did you mean 'action'?"),
        ("start: 0.5", "start: soon", ":5:25: segments.0.start: expected a number, found 'soon'"),
        ("start: 0.5", "start: -1", "start: input should be greater than or equal to 0, found -1"),
        ("start: 0.5", "start: .nan", ":5:32: '.nan' is rejected: numbers are finite"),
        ("end: 2,", "end: 0.25,", "the segment ends at 0.25 s, before its start at 0.5 s"),
        ("theta: [0.1, 2]", "theta: [0.1]", ":5:63: theta has 1 components; 'parameters' names 2: u, v"),
        ("recording: a.mcap", "recording: ../a.mcap", ":5:6: segments.0.recording: a name has no '/'"),
        ("recording: a.mcap", "recording: /a.mcap", ":5:6: segments.0.recording: a name has no '/'"),
        ("action: reaching", "action: ../reaching", "segments.0.action: a name has no '/'"),
        ("parameters: [u, v]", "parameters: [u, u]", ":2:1: parameters: each name once, found u, u"),
        ("side: left", "side: middle", ":11:5: segments.1.side: input should be 'right' or 'left', found 'middle'"),
        ("segments:", "segments: 3\nothers:", "expected a list in brackets, found 3"),
        ("# the first of them", "\t- x", ":4:3: a tab: indent with spaces"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(tmp_path, old, new, finding):
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(LabelsError) as wrong:
        load_labels(path)
    assert finding in str(wrong.value)
    assert str(wrong.value).startswith(f"{path}:")
    assert wrong.value.exit_code == 78


def test_everything_that_is_wrong_is_told_at_once(tmp_path):
    text = GOOD.replace("subject: 3", "subjekt: 3").replace("end: 1.25", "end: soon")
    with pytest.raises(LabelsError) as wrong:
        load_labels(written(tmp_path, text))
    assert len(str(wrong.value).splitlines()) == 2


def test_a_segment_twice_is_told_with_both_lines(tmp_path):
    line = GOOD.splitlines()[4]
    with pytest.raises(LabelsError, match=r":6:5: the same segment \(a.mcap, 0.5 to 2 s\) is in line 5 too"):
        load_labels(written(tmp_path, GOOD.replace(line, f"{line}\n{line}")))


def test_missing_or_empty(tmp_path):
    with pytest.raises(DemonstrationError, match="make one with `paramove demos import`") as missing:
        load_labels(tmp_path / "labels.yaml")
    assert missing.value.exit_code == 66
    with pytest.raises(LabelsError, match=r"the file is empty; expected a mapping such as 'segments: \["):
        load_labels(written(tmp_path, "# nothing\n"))


def test_comments_and_order_are_kept(tmp_path):
    path = written(tmp_path, GOOD)
    added = Segment(recording="c.mcap", start=0.0, end=1.5, action="reaching", theta=[0.25, -1e-9], subject="B")
    append_segments(path, [added])
    text = path.read_text(encoding="utf-8")
    assert text.startswith(GOOD)
    assert "- {recording: c.mcap, start: 0.0, end: 1.5, action: reaching, theta: [0.25, -1e-09], subject: B" in text
    assert load_labels(path).file.segments[2] == added
    assert [file.name for file in tmp_path.iterdir()] == ["labels.yaml"]


@pytest.mark.parametrize(
    "segments",
    [
        "segments: []  # none yet",
        "segments:   # none yet",
        "# none yet",
        "segments: [{recording: b.mcap, start: 0, end: 1, action: x}]",
        "segments:\n- {recording: b.mcap, start: 0, end: 1, action: x}  # said\n\n# behind\nmax_gap: 0.2",
        "segments:\n    - recording: b.mcap\n      start: 0\n      end: 1  # s\n      action: 'x y'\n# behind",
        "segments:\n- recording: b.mcap\n  end: 1\n  action: x\n  start: 5.064146169557204e-151",
    ],
)
@pytest.mark.parametrize("newline", ["", "\n", "\n\n"])
def test_however_the_list_is_written(tmp_path, segments, newline):
    path = written(tmp_path, f"description: d\n{segments}{newline}")
    before = load_labels(path).file
    added = [Segment(recording=name, start=0.0, end=1.5, action="reaching: it") for name in ("c.mcap", "d.mcap")]
    append_segments(path, added)
    assert load_labels(path).file == before.model_copy(update={"segments": [*before.segments, *added]})
    kept = path.read_text(encoding="utf-8")
    for line in f"description: d\n{segments}".replace("segments: []", "segments:").splitlines():
        assert line.removesuffix("]") in kept


def test_what_would_not_be_sound_is_not_written(tmp_path):
    path = written(tmp_path, GOOD)
    with pytest.raises(DemonstrationError, match="theta has 1 components"):
        append_segments(path, [Segment(recording="c.mcap", start=0.0, end=1.5, action="reaching", theta=[0.25])])
    assert path.read_text(encoding="utf-8") == GOOD
    assert [file.name for file in tmp_path.iterdir()] == ["labels.yaml"]


TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), min_size=1, max_size=20)
NAMES = TEXTS.filter(lambda text: not name_fault(text))


@settings(deadline=None, max_examples=25, derandomize=True)
@given(
    action=NAMES,
    subject=TEXTS,
    theta=st.lists(st.floats(allow_nan=False, allow_infinity=False), max_size=3),
    text=TEXTS,
)
def test_whatever_is_written_is_read(tmp_path_factory, action, subject, theta, text):
    path = tmp_path_factory.mktemp("labels") / "labels.yaml"
    segment = Segment(recording="a.mcap", start=0.1, end=0.3, action=action, theta=theta, subject=subject)
    names = [f"p{number}" for number in range(len(theta))]
    content = LabelsFile(description=text, parameters=names, segments=[segment])
    write_labels(path, content)
    assert load_labels(path).file == content
    again = segment.model_copy(update={"end": 0.4})
    append_segments(path, [again])
    assert load_labels(path).file.segments == [segment, again]
