#!/bin/sh
# Does PyTorch learn what avastra learns? Same first weights, same batches, same settings, 100 updates:
# the weights must agree to 1e-4. Needs Python 3 and, once, a network for `pip install torch`.
set -eu
cd "$(dirname "$0")/../.."
venv=target/interop/venv
if ! [ -x "$venv/bin/python" ]; then
    python3 -m venv "$venv"
fi
"$venv/bin/python" -c 'import torch' 2>/dev/null || "$venv/bin/pip" install --quiet torch numpy
cargo test --quiet --test it torch_reference -- --ignored
"$venv/bin/python" tests/interop/torch_check.py target/interop/torch.json
