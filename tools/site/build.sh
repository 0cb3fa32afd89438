#!/usr/bin/env bash
# Makes the site: `tools/site/build.sh FOLDER PROGRAM [WHEEL]`.
#
# FOLDER gets the guide as a book with search, the documentation of the crate in `api`, and with WHEEL that of the Python module in
# `python`. PROGRAM is `tetdb`, whose help is a chapter and which draws a gallery. Needs mdBook 0.5 (`cargo install mdbook`) and Python 3.11.
# DOC, if it is set, names a folder of documentation that `cargo doc` made before. LARGEST, if it is set, is the edge length of the gallery's
# largest mesh (`gallery.py`); its own takes minutes.
set -euo pipefail
mkdir -p "$1"
site=$(cd "$1" && pwd)
program=$(realpath "$2")
wheel=${3:+$(realpath "$3")}
cd "$(dirname "$0")/../.."
targets=${CARGO_TARGET_DIR:-$PWD/target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
command -v mdbook >/dev/null || { echo "site: mdBook is not installed: cargo install mdbook"; exit 77; }

doc=${DOC:-$targets/site/doc}
# In a folder of its own: other documentation in `target/doc` is no part of the site.
[ -n "${DOC:-}" ] || RUSTDOCFLAGS="-D warnings" cargo doc --quiet --locked --no-deps -p tetdb -p tetdb-schema --target-dir "$targets/site"
python3 tools/site/book.py "$program" "$doc" "$work/book" ${wheel:+python}
python3 tools/site/gallery.py "$program" "$work/book" ${LARGEST:+"$LARGEST"}
rm -rf "$site"
mdbook build --dest-dir "$site" "$work/book"
cp -r "$doc" "$site/api"

if [ -n "$wheel" ]; then
    python3 -m venv "$work/python"
    "$work/python/bin/pip" install --quiet "$wheel" pdoc
    "$work/python/bin/python" tools/site/reference.py "$site/python"
else
    echo "site: without the reference of Python: no wheel is named"
fi
python3 tools/site/links.py "$site"
