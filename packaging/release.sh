#!/usr/bin/env bash
# The archive of a release: the stripped program, its licences and those of all that is in it, README, docs, manual pages, completions and
# cases. It is tested by unpacking it in a temporary folder and running a case with it.
#
#     bash packaging/release.sh            makes target/dist/elastocap-VERSION-TARGET.tar.gz and its .sha256
#
# The program is static where the toolchain has x86_64-unknown-linux-musl (rustup target add x86_64-unknown-linux-musl). Otherwise it needs a C
# library, and the oldest version of it that will do is printed. TARGET=... chooses another
# installed target; its program is run in the test unless it is for another processor. The same sources give the same archive, byte for byte,
# with the same toolchain: times are those of the last commit (SOURCE_DATE_EPOCH), names are sorted, and owners left out.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

installed=$(rustup target list --installed 2>/dev/null || rustc -vV | sed -n 's/^host: //p')
host=$(rustc -vV | sed -n 's/^host: //p')
target=${TARGET:-}
if [ -z "$target" ]; then
    target=$host
    if grep -qx x86_64-unknown-linux-musl <<<"$installed"; then target=x86_64-unknown-linux-musl; fi
fi
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"$/\1/p' Cargo.toml)
name=elastocap-$version-$target
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || date +%s)}

# For the host itself the folder of ordinary builds serves, so that nothing is compiled twice.
if [ "$target" = "$host" ]; then
    cargo build --release --locked --bin elastocap
    built=${CARGO_TARGET_DIR:-target}/release/elastocap
else
    cargo build --release --locked --bin elastocap --target "$target"
    built=${CARGO_TARGET_DIR:-target}/$target/release/elastocap
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
into=$work/$name
mkdir -p "$into/cases" "$into/completions"
install -m 755 "$built" "$into/elastocap"
cp LICENSE-MIT LICENSE-APACHE README.md CHANGELOG.md "$into/"
cp -r cases/* "$into/cases/"
# README refers to them.
cp ARCHITECTURE.md CONTRIBUTING.md "$into/"
cp -R docs "$into/docs"
python3 packaging/licences.py "$target" >"$into/THIRD-PARTY-LICENCES.txt"
# A program for another processor cannot write these by itself.
runs=$into/elastocap
if ! "$runs" --version >/dev/null 2>&1; then
    echo "the program for $target does not run here: pages and completions are made by one for $host"
    cargo build --release --locked --bin elastocap
    runs=${CARGO_TARGET_DIR:-target}/release/elastocap
fi
"$runs" man "$into/man/man1" --quiet
"$runs" completions bash >"$into/completions/elastocap.bash"
"$runs" completions zsh >"$into/completions/_elastocap"
"$runs" completions fish >"$into/completions/elastocap.fish"
"$runs" completions powershell >"$into/completions/elastocap.ps1"
"$runs" completions elvish >"$into/completions/elastocap.elv"

mkdir -p target/dist
archive=target/dist/$name.tar.gz
tar --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner -C "$work" -cf - "$name" | gzip -n -9 >"$work/archive"
mv "$work/archive" "$archive"
(cd target/dist && sha256sum "$name.tar.gz" >"$name.tar.gz.sha256")

# What a user does with it, in a folder of its own.
test=$work/test
mkdir "$test"
tar -xzf "$archive" -C "$test"
cd "$test/$name"
for file in LICENSE-MIT LICENSE-APACHE THIRD-PARTY-LICENCES.txt README.md CHANGELOG.md man/man1/elastocap-run.1 completions/_elastocap cases/comb.toml; do
    [ -s "$file" ] || { echo "$file is missing in the archive" >&2; exit 1; }
done
if ./elastocap --version 2>/dev/null; then
    ./elastocap run cases/in-plane-pair.toml -o "$test/out"
    [ "$(wc -l <"$test/out/curve.csv")" = 7 ] || { echo "the curve of the archive's program has not six rows" >&2; exit 1; }
    bash -n completions/elastocap.bash
    # Strings of a build that is not stripped name functions.
    # Not by `grep -q`: with pipefail, nm that is cut off would count as one without symbols.
    if command -v nm >/dev/null && [ -n "$(nm elastocap 2>/dev/null | head -c 1)" ]; then
        echo "the program is not stripped" >&2
        exit 1
    fi
fi
cd - >/dev/null
if command -v objdump >/dev/null; then
    oldest=$(objdump -T "$built" 2>/dev/null | grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -1 || true)
    echo "C library: ${oldest:-none, the program is static}"
fi
ls -l "$archive"
