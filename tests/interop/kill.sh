#!/bin/sh
# Ends runs and trainings at each system call that changes a file, tears writes and fills the disk, and goes on with
# them: all must end in the same bytes. `sh tests/interop/kill.sh 5` strikes every fifth call. Needs Linux, a C
# compiler and Python.
set -e
cd "$(dirname "$0")/../.."
mkdir -p target/interop
cargo build --release --bin avastra
cc -shared -fPIC -O1 -Wall -o target/interop/kill.so tests/interop/kill.c -ldl
python3 tests/interop/kill.py "${AVASTRA:-target/release/avastra}" "$PWD/target/interop/kill.so" "${1:-1}"
