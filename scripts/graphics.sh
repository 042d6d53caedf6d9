#!/usr/bin/env bash
# See to an offscreen OpenGL library: graphics.sh PYTHON. Never fails: all but pictures works without.
set -uo pipefail
python=$1

works() { "$python" -c 'from mjchair.report import gl; gl.backend()' 2>/dev/null; }

works && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    { apt-get update -qq && apt-get install -y -qq libosmesa6 libegl1 libgl1-mesa-dri; } >/dev/null 2>&1
fi
works || echo "No offscreen OpenGL, so no video: install one with apt-get install libosmesa6" >&2
exit 0
