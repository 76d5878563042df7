"""The Python of pages gives what they show: every ```python block with prompts, those of a page one after the other."""

import doctest
import re

import pytest

from tests.docs.markdown import PAGES

BLOCK = re.compile(r"^```python\n(>>> .*?)^```$", re.M | re.S)
WITH_PROMPTS = [path for path in PAGES if BLOCK.search(path.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("path", WITH_PROMPTS, ids=lambda path: path.stem)
def test_python_gives_what_is_shown(path):
    text = path.read_text(encoding="utf-8")
    code = "\n".join(match[1] for match in BLOCK.finditer(text))
    test = doctest.DocTestParser().get_doctest(code, {}, path.stem, str(path), 0)
    report = []
    runner = doctest.DocTestRunner(verbose=False)
    runner.run(test, out=report.append)
    assert runner.failures == 0, "".join(report)
    assert len(test.examples) > 0


def test_there_is_a_page_with_python():
    assert "use_from_python" in {path.stem for path in WITH_PROMPTS}
