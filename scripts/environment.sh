#!/usr/bin/env bash
# Make the virtual environment anew: environment.sh PYTHON FOLDER
set -euo pipefail
python=$1 venv=$2

"$python" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 13))' 2>/dev/null || {
    echo "mjchair needs Python 3.11 or 3.12; found: ${python:-none}. Install python3.11." >&2
    exit 1
}
if ! "$python" -c 'import ensurepip' 2>/dev/null; then
    package=python$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update -qq && apt-get install -y -qq "$package"
    else
        echo "Python's venv module is incomplete; install it with: apt-get install $package" >&2
        exit 1
    fi
fi
rm -rf "$venv"
"$python" -m venv "$venv"
# the lock names all that is used; what kineticstoolkit wants besides (PyQt5, 200 MB, for windows; a
# look for news over the network at import) stays away. Python compiles modules when they are first
# imported, which are far fewer than --no-compile leaves out.
"$venv/bin/pip" install --quiet --no-compile --no-deps --requirement requirements.lock
"$venv/bin/pip" install --quiet --no-deps --no-build-isolation --editable .
"$venv/bin/python" scripts/compile_tires.py  # so that no first run waits for them
