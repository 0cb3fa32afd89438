#!/usr/bin/env bash
# The program's bill of materials in the format CycloneDX: `tools/packages/materials.sh FOLDER`. A wheel has its own inside.
# Needs `cargo install cargo-cyclonedx`.
set -euo pipefail
mkdir -p "$1"
out=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.."
command -v cargo-cyclonedx >/dev/null || { echo "materials: cargo-cyclonedx is not installed"; exit 77; }
cargo cyclonedx --quiet --format json --override-filename bill
mv bill.json "$out/tetdb.cdx.json"
# Each member of the workspace gets a bill; those of the others are parts of the program's.
rm -f schema/bill.json src/*/bill.json tools/bill.json
