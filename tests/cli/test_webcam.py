"""`paramove webcam setup`: exit codes."""

from typer.testing import CliRunner

from paramove.cli.webcam import app


def test_a_file_that_is_not_the_package_ends_with_66(tmp_path):
    (tmp_path / "a.whl").write_bytes(b"no package")
    answer = CliRunner().invoke(app, ["setup", "--wheel", str(tmp_path / "a.whl")])
    assert answer.exit_code == 66
    assert "a.whl" in answer.stderr
