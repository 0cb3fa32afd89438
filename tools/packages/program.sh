#!/usr/bin/env bash
# Builds the program and packs it: `tools/packages/program.sh FOLDER [TARGET [PROFILE]]`.
#
# FOLDER gets tetdb-TARGET.tar.gz with the program, manual pages, completions and licences, the sum of its bytes in
# tetdb-TARGET.tar.gz.sha256, and where `cargo deb` is installed a package for Debian and Ubuntu. TARGET is this machine's by default;
# the program must run here, for it writes its manual pages itself. x86_64-unknown-linux-musl gives a program that needs no library of
# the system; it needs `rustup target add x86_64-unknown-linux-musl` and musl-gcc (Debian's musl-tools).
# PROGRAM, if it is set, names the program, built before.
set -euo pipefail
mkdir -p "$1"
out=$(cd "$1" && pwd)
target=${2:-$(rustc -vV | sed -n 's/^host: //p')}
profile=${3:-release}
program=${PROGRAM:+$(realpath "$PROGRAM")}
cd "$(dirname "$0")/../.."
targets=${CARGO_TARGET_DIR:-$PWD/target}

if [ -z "$program" ]; then
    if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ]; then
        echo "Rust's standard library for $target is not installed: rustup target add $target"
        exit 77
    fi
    cargo build --profile "$profile" --locked --bin tetdb --target "$target"
    program=$targets/$target/$profile/tetdb
fi

name=tetdb-$target
files=$targets/package-files
rm -rf "$files"
mkdir -p "$files/$name/man" "$files/$name/completions"
cp "$program" "$files/$name/tetdb"
program=$files/$name/tetdb
"$program" man --dir "$files/$name/man" --quiet
for shell in bash zsh fish powershell elvish; do
    "$program" completions $shell >"$files/$name/completions/tetdb.$shell"
done
cp README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE "$files/$name/"

# What is packed must mesh and find its own mesh valid.
"$program" mesh sample:box,h=0.5 -o "$files/box.tetdb" --quiet
"$program" verify "$files/box.tetdb" --full | tail -1

# The program lies at the top of the archive, where `cargo binstall` looks for it, by a name without `./`.
(cd "$files/$name" && tar -c -z -f "$out/$name.tar.gz" -- *)
(cd "$out" && { sha256sum "$name.tar.gz" 2>/dev/null || shasum -a 256 "$name.tar.gz"; } >"$name.tar.gz.sha256")

if [ -n "$(command -v cargo-deb)" ] && [ "${target%gnu}" != "$target" ]; then
    # `package.metadata.deb` of Cargo.toml names the files by this folder.
    rm -rf "$targets/deb-files"
    cp -r "$files/$name" "$targets/deb-files"
    cargo deb --no-build --no-strip --profile "$profile" --output "$out/"
else
    echo "no package for Debian: $target is not a GNU system's, or cargo-deb is not installed"
fi
ls -l "$out"
