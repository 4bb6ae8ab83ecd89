#!/usr/bin/env bash
# Runs the studies of docs/accuracy.md anew: all, or those named. Each takes less than a minute; the machine should have nothing else to do.
set -euo pipefail
cd "$(dirname "$0")/../.."

studies=("$@")
if [ ${#studies[@]} -eq 0 ]; then
    studies=(near_contact env_rob thousand_bodies thin_transversal thin_grazing)
fi
for study in "${studies[@]}"; do
    cargo run --quiet --release --package collided -- accuracy "docs/accuracy/scenes/$study.json" --out "docs/accuracy/$study"
done
