#!/bin/sh
# Holds the committed traces of ten episodes against a debug and a release build of this machine.
# Not part of `cargo test`, because a release build takes minutes.
set -eu
cd "$(dirname "$0")/../.."
for profile in dev release; do
    echo "profile $profile"
    INSTA_UPDATE=no cargo test --profile "$profile" --test it traces::
done
