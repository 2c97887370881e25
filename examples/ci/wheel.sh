#!/usr/bin/env bash
# Builds the wheel, installs it into a virtual environment of its own, and runs what it brought:
#   examples/ci/wheel.sh            optimised, into target/wheels
#   PROFILE=dev examples/ci/wheel.sh   with the dependencies that cargo test has built, to try the packaging
# Needs Python 3.9, its venv module, and Rust.
set -euo pipefail
cd "$(dirname "$0")/../.."

profile=${PROFILE:-release}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/build"
"$work/build/bin/pip" install --quiet 'maturin>=1.9,<2'
"$work/build/bin/maturin" build --profile "$profile" --out "$work/wheels"

python3 -m venv "$work/clean"
"$work/clean/bin/pip" install --quiet "$work"/wheels/posescope-*.whl
cd "$work"   # nothing of the project is at hand here
"$work/clean/bin/posescope" --version
"$work/clean/bin/posescope" lesson
"$work/clean/bin/posescope" run street --query 70 --reference 62 --save first.rrd
test -s first.rrd
"$work/clean/bin/python" - <<'END'
import posescope

street = posescope.Scene.street()
result = posescope.localize(street.query("70"), street.reference("62"))
print(result.pose)
print(result.confidence)
END

cd - >/dev/null
mkdir -p target/wheels
cp "$work"/wheels/*.whl target/wheels/
ls -l target/wheels
