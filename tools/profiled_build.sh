#!/bin/sh
# Builds tetdb as it runs best on the machine at hand: a build that counts its branches, some meshes, and the build that knows them.
#
#   rustup component add llvm-tools
#   sh tools/profiled_build.sh [DIRECTORY]
#
# The program is DIRECTORY/bin/tetdb (target/profiled/bin/tetdb without). Meshes are the same, bit by bit. It takes three times a build.
set -eu
cd "$(dirname "$0")/.."
dir=${1:-target/profiled}
mkdir -p "$dir/bin"
dir=$(cd "$dir" && pwd)
host=$(rustc -vV | sed -n 's/^host: //p')
merge=$(rustc --print sysroot)/lib/rustlib/$host/bin/llvm-profdata
[ -x "$merge" ] || { echo "no $merge: rustup component add llvm-tools" >&2; exit 1; }

# With a target named, build scripts are not counted.
build() {
    RUSTFLAGS="$1" CARGO_TARGET_DIR="$dir/$2" cargo build --release --target "$host"
}

rm -rf "$dir/counts"
build "-Cprofile-generate=$dir/counts" counting
counting=$dir/counting/$host/release/tetdb
store=$dir/store.tetdb
for sample in balls,count=100 box,h=0.03 grains,count=300 caps steps; do
    "$counting" mesh "sample:$sample" -o "$store" --force --quiet --threads 1
done
"$counting" mesh sample:balls,count=100 -o "$store" --force --quiet --threads 2 --subdomains 4
"$counting" verify "$store" --full --quiet
rm -rf "$store"
"$merge" merge -o "$dir/counts.profdata" "$dir/counts"
build "-Cprofile-use=$dir/counts.profdata" known
cp "$dir/known/$host/release/tetdb" "$dir/bin/tetdb"
echo "built $dir/bin/tetdb"
