"""A report is one file: nothing of what it shows lies elsewhere, and words cannot become HTML."""

import base64
from html.parser import HTMLParser

from paramove.documents.reports import film, folded, image, report_page, section, table


class Seen(HTMLParser):
    """Texts by the innermost tag that they stand in, and all sources."""

    def __init__(self, text):
        super().__init__()
        self.texts, self.sources, self._open = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self._open.append(tag)
        self.sources += [value for name, value in attributes if name in ("src", "href")]

    def handle_endtag(self, tag):
        self._open = self._open[: len(self._open) - 1 - self._open[::-1].index(tag)]

    def handle_data(self, data):
        self.texts.append((self._open[-1] if self._open else "", data))


def test_words_stand_on_the_page_as_they_are():
    parts = [
        section("a < b", "why & how", table(("x", "y"), [("1", "2")], numbers=(1,))),
        "",
        folded("more", "<p>z</p>"),
    ]
    seen = Seen(report_page("A <title>", "1 < 2", "5 & 6", parts))
    for shown in (
        ("title", "A <title>"),
        ("h1", "1 < 2"),
        ("h2", "a < b"),
        ("td", "2"),
        ("summary", "more"),
        ("p", "z"),
    ):
        assert shown in seen.texts
    assert "\n\n" not in report_page("t", "h", "a", ["", "<p>z</p>"]).partition("</header>")[2]


def test_the_head_tells_good_from_bad():
    assert "class=bad" not in report_page("t", "h", "a", [])
    assert "<header class=bad>" in report_page("t", "h", "a", [], good=False)


def test_pictures_and_films_are_in_the_file(tmp_path):
    video = tmp_path / "run.mp4"
    video.write_bytes(b"film")
    seen = Seen(report_page("t", "h", "a", [image(b"picture", "an 'arm'"), film(video), film(None)]))
    kinds = [source.partition(",")[0] for source in seen.sources]
    assert kinds == ["data:image/png;base64", "data:video/mp4;base64"]
    assert [base64.b64decode(source.partition(",")[2]) for source in seen.sources] == [b"picture", b"film"]
