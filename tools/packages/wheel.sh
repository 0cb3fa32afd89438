#!/usr/bin/env bash
# Builds the source package and the wheel, and tries the wheel: `tools/packages/wheel.sh FOLDER [PROFILE]`.
#
# The wheel is built from the contents of the source package, so both are known to be complete. It serves Python 3.10 and later. On
# Linux, zig links against glibc 2.28, whatever this machine has; ZIG=0 links against this machine's, without zig.
# Exit code 77: what builds it could not be installed.
set -euo pipefail
mkdir -p "$1"
out=$(cd "$1" && pwd)
profile=${2:-release}
cd "$(dirname "$0")/../python"
# Builds of an earlier call are used again, whatever folder the sources lie in.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
missing() { echo "wheel: $1"; exit 77; }
# The Python of an environment, whose folder has another name on Windows.
python_of() { if [ -d "$1/Scripts" ]; then echo "$1/Scripts"; else echo "$1/bin"; fi; }

base=$(command -v python3 || command -v python) || missing "no Python 3"
"$base" -m venv "$work/build" || missing "no Python 3 with venv"
tools=$(python_of "$work/build")
maturin=maturin options=()
if [ "$(uname -s)" = Linux ]; then
    if [ "${ZIG:-1}" = 1 ]; then
        maturin='maturin[zig]' options=(--zig --compatibility manylinux_2_28)
    else
        options=(--compatibility linux)
    fi
fi
"$tools/python" -m pip install --quiet "$maturin>=1.9,<2" || missing "$maturin could not be installed"
export PATH=$tools:$PATH

rm -f "$out"/tetdb-*.tar.gz "$out"/tetdb-*.whl
maturin sdist --out "$out" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
# Files of the archive have old dates; without them cargo takes no changed file for an unchanged one.
tar -x -m -z -f "$out"/tetdb-*.tar.gz -C "$work"
(cd "$work"/tetdb-* && maturin build --quiet --profile "$profile" --locked ${options[@]+"${options[@]}"} --out "$out")

# An empty environment, to which the wheel brings NumPy and nothing else: three lines give a mesh and a picture.
"$base" -m venv "$work/empty"
python=$(python_of "$work/empty")/python
"$python" -m pip install --quiet "$out"/tetdb-*.whl
cd "$work"
"$python" -c '
import tetdb
store = tetdb.mesh(tetdb.sample("box,h=0.5"), "box.tetdb", hsiz="20%")
store.snapshot("box.png", color="quality")'
"$python" -c 'import sys; sys.exit(open("box.png", "rb").read(8) != b"\x89PNG\r\n\x1a\n")' || { echo "box.png is no picture"; exit 1; }
ls -l "$out"
