#!/usr/bin/env bash
# Make the virtual environment anew: environment.sh PYTHON FOLDER
set -euo pipefail
python=$1 venv=$2

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || {
    echo "mjchair needs Python 3.11 or newer; found: ${python:-none}. Install python3.11." >&2
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
"$venv/bin/pip" install --quiet --requirement requirements.lock
"$venv/bin/pip" install --quiet --no-deps --no-build-isolation --editable .
