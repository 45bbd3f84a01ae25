#!/bin/sh
# Opens the real window under a virtual display, presses real keys, and checks what came of it.
# Debian: apt-get install xvfb xdotool ffmpeg libgl1-mesa-dri libgl1 libegl1 libx11-6 libx11-xcb1 libxcursor1 libxi6 \
#         libxkbcommon0 libxkbcommon-x11-0
set -eu
cd "$(dirname "$0")/.."
for tool in Xvfb xdotool ffmpeg; do
    command -v "$tool" >/dev/null || { echo "tests/window.sh needs $tool" >&2; exit 1; }
done
cargo test --features "${FEATURES:-play}" --test it window -- --ignored --nocapture
