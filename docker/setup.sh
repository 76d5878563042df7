#!/bin/sh
# Makes this clone ready to run: Debian packages, a virtual environment in .venv, the package itself, warm caches.
# `make demo`, `make test`, .ci/run and docker/Dockerfile call it; when nothing is missing it ends at once.
#
# Usage: docker/setup.sh
#   PYTHON=/path/to/python3.12   interpreter to use (default: the first of python3, python3.13 ... that is new enough)
# Exit codes: 0 ready; 1 an installation failed; 3 something is missing that only an administrator can install
# (the one command for him is printed).
set -eu
cd "$(dirname "$0")/.."

say() { printf 'set-up: %s\n' "$*"; }

# --- Python ----------------------------------------------------------------------------------------------------------
is_supported() { "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))' 2>/dev/null; }

find_python() {
    for candidate in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
        if command -v "$candidate" >/dev/null 2>&1 && is_supported "$candidate"; then
            command -v "$candidate"
            return 0
        fi
    done
    return 1
}

python=$(find_python) || {
    say "no Python 3.11, 3.12 or 3.13 found (looked for: ${PYTHON:-python3, python3.13, python3.12, python3.11})." >&2
    say "Debian 12 and later: as root run" >&2
    printf '    apt-get update && apt-get install -y python3 python3-venv\n' >&2
    exit 3
}

# --- Nothing to do? --------------------------------------------------------------------------------------------------
stamp=.venv/paramove-setup
wanted="$(cat requirements.lock pyproject.toml docker/setup.sh | sha256sum | cut -c1-64) $(pwd)"
if [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ] && .venv/bin/python -c '' 2>/dev/null; then
    exit 0
fi

# --- Debian packages -------------------------------------------------------------------------------------------------
# MuJoCo draws without a display through EGL or, with less to install, through OSMesa.
has_library() { "$python" -c 'import ctypes, sys; [ctypes.CDLL(name) for name in sys.argv[1:]]' "$@" 2>/dev/null; }

missing=""
if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    case "$(readlink -f "$python")" in
        /usr/bin/*) missing="$missing $("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')" ;;
        *)
            say "$python cannot make virtual environments (no ensurepip); choose another one with PYTHON=..." >&2
            exit 3
            ;;
    esac
fi
has_library libOSMesa.so.8 || has_library libEGL.so.1 libOpenGL.so.0 || missing="$missing libosmesa6"

if [ -n "$missing" ]; then
    if ! command -v apt-get >/dev/null 2>&1; then
        say "missing, and not installed here because this is no Debian:$missing (names of the Debian packages)" >&2
        exit 3
    elif [ "$(id -u)" = 0 ]; then
        say "installs the Debian packages:$missing"
        apt-get update -qq
        # shellcheck disable=SC2086
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
    else
        say "Debian packages are missing, and only an administrator can install them. As root run" >&2
        printf '    apt-get update && apt-get install -y --no-install-recommends%s\n' "$missing" >&2
        say "then repeat what you did." >&2
        exit 3
    fi
fi

# --- Virtual environment ---------------------------------------------------------------------------------------------
if [ -e .venv ] && ! is_supported .venv/bin/python; then
    say "replaces .venv, whose Python does not run or is not supported"
    rm -rf .venv
fi
if [ ! -x .venv/bin/python ]; then
    say "makes .venv with $("$python" --version)"
    "$python" -m venv .venv
fi
say "installs the Python packages of requirements.lock into .venv (about 1 GB; minutes, once)"
# --no-compile: Python compiles the modules that are imported; pip would compile all, of which most never are.
.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --require-hashes --only-binary :all: \
    --requirement requirements.lock
.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
if [ -n "${PYTHONDONTWRITEBYTECODE:-}" ]; then
    # Images of containers often set it. Nothing would be kept then, and each process compiles all that it imports: a second of a processor.
    say "compiles the Python modules, as PYTHONDONTWRITEBYTECODE lets no process keep what it has compiled"
    .venv/bin/python -m compileall -q -j 0 -x '/tests/' .venv/lib src nodes sim >/dev/null || : # some packages hold files of no Python
fi

# --- Does it draw? ---------------------------------------------------------------------------------------------------
draws() {
    MUJOCO_GL=$1 .venv/bin/python -c 'import mujoco; mujoco.GLContext(64, 64).make_current()' >/dev/null 2>&1
}
if ! draws osmesa && ! draws egl; then
    say "MuJoCo can draw neither with MUJOCO_GL=osmesa nor with MUJOCO_GL=egl; what it says:" >&2
    MUJOCO_GL=osmesa .venv/bin/python -c 'import mujoco; mujoco.GLContext(64, 64).make_current()' 2>&1 | tail -n 3 >&2
    if [ "$(id -u)" != 0 ]; then
        say "As root run" >&2
        printf '    apt-get update && apt-get install -y --no-install-recommends libosmesa6\n' >&2
    fi
    exit 1
fi

# --- Compiled kernels ------------------------------------------------------------------------------------------------
if [ -f src/paramove/cli/warm.py ]; then
    say "compiles the numerical kernels (one or two minutes, once)"
    .venv/bin/paramove warm
fi

printf '%s' "$wanted" >"$stamp"
say "ready"
