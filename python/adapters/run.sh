#!/bin/sh
# Runs a driving system that others wrote: `sh python/adapters/run.sh sumo:EIDM scenarios/avastra45.ava --episodes 20`.
#
# NAME is a folder beside this file; what follows a colon is an option of the adapter. The rest are the arguments of `avastra run`; without
# them only the profile is written, for other commands: `avastra replay FILES --ads target/adapters/sumo.yaml`.
# The packages are installed once, under target/adapters/NAME. The driver gets the truth instead of what `modular`
# perceives, so that its mistakes are its own; OBSERVATION=perceived changes that. PYTHON is the Python to install into, AVASTRA the command.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
choice=${1:?"name an adapter: $(cd "$here" && echo */ | tr -d /)"}
shift
name=${choice%%:*}
option=${choice#"$name"}
option=${option#:}
[ -f "$here/$name/driver.py" ] || { echo "run.sh: there is no adapter \`$name\`; there are: $(cd "$here" && echo */ | tr -d /)" >&2; exit 1; }

venv=$root/target/adapters/$name
# Python 3.11 is what the adapters were written with and what every package of theirs has wheels for; others may do.
find_python() {
    for python in ${PYTHON:-python3.11 python3 python3.12 python3.10 python3.9}; do
        if "$python" -c 'import sys; sys.exit(sys.version_info < (3, 9))' 2>/dev/null; then
            echo "$python"
            return
        fi
    done
    echo "run.sh: there is no Python from 3.9 on: tried ${PYTHON:-python3.11, python3, python3.12, python3.10 and python3.9}; PYTHON names another" >&2
    exit 1
}
if ! cmp -s "$here/$name/requirements.txt" "$venv/installed"; then
    python=$(find_python)
    "$python" -m venv "$venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -r "$here/$name/requirements.txt"
    # What pip cannot install, an adapter fetches itself, into the folder that it is told.
    [ ! -f "$here/$name/install.py" ] || "$venv/bin/python" "$here/$name/install.py" "$venv"
    cp "$here/$name/requirements.txt" "$venv/installed"
fi

# Each time: what an older installation named may not be all.
packages=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
printf '%s\n' "$root/python" "$here" >"$packages/avastra.pth"
profile=$venv${option:+.$option}.yaml
cat >"$profile" <<YAML
ads:
  command: ["$venv/bin/python", "$here/$name/driver.py"${option:+, \"$option\"}]
  observation: ${OBSERVATION:-truth}
  timeouts: { init: 120, step: 30 }
YAML
if [ $# -eq 0 ]; then
    echo "$profile"
    exit 0
fi
if [ -z "${AVASTRA:-}" ]; then
    AVASTRA=$root/target/release/avastra
    (cd "$root" && cargo build --release --quiet)
fi
exec "$AVASTRA" run "$@" --ads "$profile"
