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
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
# At the same place in every call: cargo builds dependencies anew when its linker has another path.
tools=$CARGO_TARGET_DIR/wheel-tools
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
missing() { echo "wheel: $1"; exit 77; }

[ -x "$tools/bin/python" ] || python3 -m venv "$tools" || missing "no Python 3 with venv"
maturin=maturin options=()
if [ "$(uname -s)" = Linux ] && [ "${ZIG:-1}" = 1 ]; then
    maturin='maturin[zig]' options=(--zig --compatibility manylinux_2_28)
elif [ "$(uname -s)" = Linux ]; then
    options=(--compatibility linux)
fi
"$tools/bin/pip" install --quiet "$maturin>=1.9,<2" || missing "$maturin could not be installed"
export PATH=$tools/bin:$PATH

rm -f "$out"/tetdb-*.tar.gz "$out"/tetdb-*.whl
maturin sdist --out "$out" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
# Files of the archive have an old date, by which cargo would take a changed file for an unchanged one; -m gives them today's.
tar -x -m -z -f "$out"/tetdb-*.tar.gz -C "$work"
(cd "$work"/tetdb-* && maturin build --quiet --profile "$profile" --locked ${options[@]+"${options[@]}"} --out "$out")

# An empty environment, to which the wheel brings NumPy and nothing else: three lines give a mesh and a picture.
python3 -m venv "$work/empty"
python=$work/empty/bin/python
"$python" -m pip install --quiet "$out"/tetdb-*.whl
cd "$work"
"$python" -c '
import tetdb
store = tetdb.mesh(tetdb.sample("box,h=0.5"), "box.tetdb", hsiz="20%")
store.snapshot("box.png", color="quality")'
"$python" -c 'import sys; sys.exit(open("box.png", "rb").read(8) != b"\x89PNG\r\n\x1a\n")' || { echo "box.png is no picture"; exit 1; }
ls -l "$out"
