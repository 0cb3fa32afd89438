#!/usr/bin/env bash
# What the changelog says of a version: `tools/packages/notes.sh 1.2.3`. Fails if that is not the version of the sources, or if the
# changelog does not have it with its date.
set -euo pipefail
cd "$(dirname "$0")/../.."
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -1)
[ "$1" = "$version" ] || { echo "Cargo.toml has version $version, not $1" >&2; exit 1; }
grep -qE "^## $version – [0-9]{4}-[0-9]{2}-[0-9]{2}\$" CHANGELOG.md ||
    { echo "CHANGELOG.md has no line \`## $version – YEAR-MONTH-DAY\`" >&2; exit 1; }
awk -v head="## $version " 'index($0, "## ") == 1 { inside = index($0, head) == 1; next } inside' CHANGELOG.md
