#!/bin/sh
# Lints and builds the Python package with its engine, checks its metadata, runs its tests with Gymnasium 1.2.2 and 1.4.0, the
# oldest and the newest that are tested, its notebooks, and mypy. PROFILE=dev builds faster. Needs Python 3.9 or later with venv, Rust, and PyPI for the first run.
set -eu
cd "$(dirname "$0")/../.."
root=target/interop/wheel
profile=${PROFILE:-release}
case $profile in dev) folder=debug ;; *) folder=$profile ;; esac
export AVASTRA="$PWD/target/$folder/avastra"
python=${PYTHON:-python3}
mkdir -p "$root"
if [ ! -e "$root/tools/installed" ]; then
    "$python" -m venv "$root/tools"
    "$root/tools/bin/pip" install --quiet 'maturin>=1.10,<2' twine
    touch "$root/tools/installed"
fi
cargo fmt -p avastra-python --check
cargo clippy --quiet -p avastra-python -- -D warnings
rm -rf "$root/dist"
PATH="$PWD/$root/tools/bin:$PATH" maturin build --profile "$profile" --manifest-path python/native/Cargo.toml --out "$root/dist"
"$root/tools/bin/twine" check --strict "$root"/dist/*.whl
cargo build --quiet --profile "$profile"
for gymnasium in 1.2.2 1.4.0; do
    venv=$root/gymnasium-$gymnasium
    if [ ! -e "$venv/ready" ]; then
        "$python" -m venv "$venv"
        "$venv/bin/pip" install --quiet "gymnasium==$gymnasium" pandas polars nbclient nbformat ipykernel
        touch "$venv/ready"
    fi
    "$venv/bin/pip" install --quiet --force-reinstall --no-deps "$root"/dist/*.whl
    # From python/tests, so that the installed package is tested and not the folder.
    (cd python/tests/engine && "$OLDPWD/$venv/bin/python" -m unittest discover -s .)
    (cd python/tests && "$OLDPWD/$venv/bin/python" -m unittest discover -s .)
    "$venv/bin/python" tests/interop/notebook.py
done
# What a user's type checker sees of the package, its own modules included.
"$venv/bin/pip" install --quiet mypy
(cd python && "$OLDPWD/$venv/bin/python" -m mypy --strict avastra)
