#!/usr/bin/env bash
# Builds the runtime for browsers and Node: target/wasm/gonogo.wasm, or the file named. Exits with 77 where no toolchain can.
#
# With the wasm32-unknown-unknown library of the compiler in use (rustup target add) it is an ordinary build. Without, Debian's
# rustc-web and rust-web-src do: an older compiler with the sources of its own standard library, which cargo then builds too.
# Where that compiler is older than 1.88, what the runtime and `image` use of later versions exists in it behind feature gates.
set -euo pipefail
cd "$(dirname "$0")/.."

out="${1:-target/wasm/gonogo.wasm}"
target=wasm32-unknown-unknown
folder="${CARGO_TARGET_DIR:-target}/wasm"
sysroot="$(rustc --print sysroot)"
host="$(rustc -vV | sed -n 's/^host: //p')"
build=(cargo rustc --locked --release --lib --crate-type cdylib --no-default-features --features c
    --target "$target" --target-dir "$folder")
export CARGO_PROFILE_RELEASE_PANIC=abort CARGO_PROFILE_RELEASE_STRIP=true
export RUSTFLAGS="-Ctarget-feature=+simd128,+nontrapping-fptoint"

debian_rustc=/usr/bin/rustc
debian_source=/usr/lib/rustlib/src/rust/library

if [ -d "$sysroot/lib/rustlib/$target" ]; then
    "${build[@]}"
elif [ -x "$debian_rustc" ] && [ -d "$debian_source/std" ]; then
    minor="$("$debian_rustc" --version | sed -n 's/^rustc 1\.\([0-9]*\)\..*/\1/p')"
    gates='[]'
    if [ "${minor:-0}" -lt 88 ]; then
        gates='["-Zcrate-attr=feature(let_chains,unsigned_is_multiple_of,slice_as_chunks)"]'
    fi
    export RUSTC="$debian_rustc" RUSTC_BOOTSTRAP=1
    RUSTFLAGS+=" -Clinker=$sysroot/lib/rustlib/$host/bin/rust-lld"
    "${build[@]}" --ignore-rust-version -Zbuild-std=std,panic_abort -Zbuild-std-features= -Zprofile-rustflags \
        --config "profile.release.package.image.rustflags=$gates" \
        --config "profile.release.package.gonogo.rustflags=$gates"
else
    echo "no toolchain for $target: rustup target add $target, or apt-get install rustc-web rust-web-src" >&2
    exit 77
fi
mkdir -p "$(dirname "$out")"
cp "$folder/$target/release/gonogo.wasm" "$out"
