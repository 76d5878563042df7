#!/usr/bin/env bash
# foxglove-schemas-protobuf 0.4.0 declares protobuf>=3.20, and its messages can be imported from protobuf 5.29.6 on only.
#
# Expected: every protobuf that the package's own metadata accepts imports its messages; `pip check` reports what does not fit.
# Seen:     with protobuf 5.29.5 `pip check` finds nothing broken, and the import of any message raises VersionError, because
#           the generated code is from protoc 29.6 and a runtime must not be older than it. A project that declares a range of
#           protobuf has to declare this floor itself.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check foxglove-schemas-protobuf==0.4.0

imported_with() {
    "$folder/venv/bin/pip" install --quiet --disable-pip-version-check "protobuf==$1"
    "$folder/venv/bin/pip" check >/dev/null
    "$folder/venv/bin/python" -c '
import google.protobuf
try:
    import foxglove_schemas_protobuf.Log_pb2
    result = "imports"
except Exception as error:
    result = type(error).__name__
print(google.protobuf.__version__, result)'
}

"$folder/venv/bin/python" -c '
from importlib.metadata import requires
print("declared:", *requires("foxglove-schemas-protobuf"))' >"$folder/seen"
imported_with 5.29.5 >>"$folder/seen"
imported_with 5.29.6 >>"$folder/seen"

cat >"$folder/expected" <<'END'
declared: protobuf>=3.20
5.29.5 VersionError
5.29.6 imports
END
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
