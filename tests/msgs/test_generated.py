"""The committed message code is what the schemas say."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def generator() -> ModuleType:
    pytest.importorskip("grpc_tools", reason="the generator is a development dependency")
    spec = importlib.util.spec_from_file_location("generate", ROOT / "msgs" / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_committed_code_is_what_the_schemas_say(generator: ModuleType) -> None:
    assert generator.differences() == []


def test_a_changed_schema_is_noticed(generator: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    schemas = tmp_path / "msgs"
    schemas.mkdir()
    for schema in (ROOT / "msgs").glob("*.proto"):
        text = schema.read_text(encoding="utf-8")
        (schemas / schema.name).write_text(text.replace("uint64 tick = 2;", "uint64 tick = 9;"), encoding="utf-8")
    monkeypatch.setattr(generator, "SCHEMAS", schemas)
    assert generator.differences() == ["clock_pb2.py"]


def test_another_generator_version_is_refused(generator: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generator, "GENERATOR_VERSION", "0.0.0")
    with pytest.raises(RuntimeError, match=r"install grpcio-tools==0\.0\.0"):
        generator.generate(Path(sys.prefix))
