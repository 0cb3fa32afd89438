#!/usr/bin/env bash
# Bills of materials in the format CycloneDX, of the program and of the Python module: `tools/packages/materials.sh FOLDER`.
# Needs `cargo install cargo-cyclonedx`.
set -euo pipefail
mkdir -p "$1"
out=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.."
command -v cargo-cyclonedx >/dev/null || { echo "materials: cargo-cyclonedx is not installed"; exit 77; }
for folder in . tools/python; do
    cargo cyclonedx --quiet --format json --manifest-path "$folder/Cargo.toml" --override-filename bill
done
mv bill.json "$out/tetdb.cdx.json"
mv tools/python/bill.json "$out/tetdb-python.cdx.json"
# Each member of the workspace gets a bill; those of the others are parts of the program's.
rm -f schema/bill.json src/*/bill.json tools/bill.json
