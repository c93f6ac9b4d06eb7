# Sourced by gallery.sh and maps.sh: `root`, `work` and `venv`, a Python with the readers and tools that they compare
# with. Needs python3 with venv, and PyPI for the first run; everything stays under target/interop.
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$root/target/interop
venv=$work/venv
mkdir -p "$work"
if [ ! -e "$venv/installed-2" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet carla==0.9.16 eclipse-sumo==1.28.0 opendrive2lanelet==1.2.1
    touch "$venv/installed-2"
fi
