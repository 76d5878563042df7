"""Whether Python, the packages and OpenCV meet the requirements of this version of paramove."""

from __future__ import annotations

import functools
import platform
import shlex
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from importlib.metadata import Distribution, distributions

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from paramove.diagnosis.finding import Finding, Fix, Level, Machine

OURS = "paramove"
OPENCV = "opencv-contrib-python-headless"
IMPORT_CV2 = "import cv2; print(cv2.__version__)"
TIMEOUT_S = 60.0


def installation_findings(_: Machine) -> Iterator[Finding]:
    """Of the interpreter that runs this."""
    installed = [one for one in distributions() if _is_whole(one)]
    ours = next((one for one in installed if one.name == OURS), None)
    if ours is None:
        yield Finding("packages", Level.PROBLEM, "paramove itself is not installed", ("make setup",))
        return
    yield python_finding(ours.metadata["Requires-Python"] or "", platform.python_version())
    yield platform_finding(platform.system(), platform.machine())
    yield packages_finding(ours.requires or (), installed)
    yield opencv_finding(installed)


def _is_whole(package: Distribution) -> bool:
    """Not what an interrupted pip left behind."""
    return "\nName: " in "\n" + (package.read_text("METADATA") or package.read_text("PKG-INFO") or "")


def python_finding(allowed: str, version: str) -> Finding:
    """Whether this Python is one of those that are allowed, such as ">=3.11,<3.14"."""
    if SpecifierSet(allowed).contains(version, prereleases=True):
        return Finding("python", Level.OK, f"Python {version} ({sys.executable})", facts={"version": version})
    remedy = ("make clean", "PYTHON=/path/to/python3.12 make setup")
    return Finding("python", Level.PROBLEM, f"Python {version} found, {allowed} needed", remedy)


def platform_finding(system: str, machine: str) -> Finding:
    """Tests run on Linux x86_64 only."""
    if (system, machine) == ("Linux", "x86_64"):
        return Finding("platform", Level.OK, f"{system} {machine}")
    return Finding("platform", Level.WARNING, f"{system} {machine} found: tests run on Linux x86_64 only")


def packages_finding(required: Iterable[str], installed: Iterable[Distribution]) -> Finding:
    """Whether every package that is needed is there, in a version that is allowed.

    Args:
        required: As in a package's metadata; those of extras are ignored.
        installed: What Python finds, the first of a name first.
    """
    versions: dict[str, str] = {}
    for one in installed:
        versions.setdefault(canonicalize_name(one.name), one.version)
    wrong, needed = dict[str, str](), 0
    for requirement in map(Requirement, required):
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        needed += 1
        version = versions.get(canonicalize_name(requirement.name))
        if version is None or not requirement.specifier.contains(version, prereleases=True):
            state = "is missing" if version is None else f"is {version}"
            wrong[f"{requirement.name}{requirement.specifier}"] = f"{requirement.name} {state}"
    if not wrong:
        return Finding("packages", Level.OK, f"all {needed} required packages are installed")
    message = "; ".join(f"{state}, {required_version} is needed" for required_version, state in wrong.items())
    return _fixed_by_pip("packages", message, [("install", *wrong)])


def opencv_finding(installed: Iterable[Distribution], script: str = IMPORT_CV2) -> Finding:
    """Whether one package alone owns cv2, and it can be imported.

    Args:
        installed: What Python finds.
        script: Imports cv2 and prints its version; run by a process of its own, which may crash.
    """
    packages = list(installed)
    owners = sorted({one.name for one in packages if _owns_cv2(one)})
    again = ("install", "--force-reinstall", "--no-deps", _required_opencv(packages))
    if len(owners) > 1:
        named = " and ".join(f"{owner}{_required_by(owner, packages)}" for owner in owners)
        message = f"{named} both install cv2: the later one has overwritten the other"
        return _fixed_by_pip("opencv", message, [("uninstall", "-y", *owners), again])
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", script], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return _fixed_by_pip("opencv", f"cv2 is not imported within {TIMEOUT_S:g} s", [again])
    if done.returncode != 0:
        error = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        return _fixed_by_pip("opencv", f"cv2 of {' '.join(owners) or 'no package'} is broken: {error[0]}", [again])
    return Finding("opencv", Level.OK, f"cv2 {done.stdout.strip()} of {' '.join(owners)}")


def _owns_cv2(package: Distribution) -> bool:
    record = package.read_text("RECORD") or ""
    return record.startswith("cv2/") or "\ncv2/" in record


def _required_by(name: str, installed: Iterable[Distribution]) -> str:
    """Which other packages brought this one, in brackets; "" if none did."""
    names = sorted(
        package.name
        for package in installed
        if any(canonicalize_name(Requirement(text).name) == canonicalize_name(name) for text in package.requires or ())
    )
    return f" (of {', '.join(names)})" if names else ""


def _required_opencv(installed: Iterable[Distribution]) -> str:
    """By paramove's metadata."""
    ours = next((one for one in installed if one.name == OURS), None)
    texts = (ours.requires or ()) if ours is not None else ()
    matches = (one for one in map(Requirement, texts) if one.name == OPENCV)
    return next((f"{one.name}{one.specifier}" for one in matches), OPENCV)


def _fixed_by_pip(subject: str, message: str, calls: Sequence[Sequence[str]]) -> Finding:
    commands = [(sys.executable, "-P", "-m", "pip", *call) for call in calls]
    remedy = tuple(map(shlex.join, commands))
    fix = Fix(f"run {' && '.join(remedy)}", functools.partial(_run_all, commands))
    return Finding(subject, Level.PROBLEM, message, remedy, fix)


def _run_all(commands: Iterable[Sequence[str]]) -> None:
    for command in commands:
        subprocess.run(command, check=True, stdout=sys.stderr)
