#!/bin/sh
# Makes win_amd64.lock: what requirements.lock says, resolved for 64-bit Windows and Python 3.11.
# pip reads the markers of a universal list with the eyes of the computer it runs on, so that a
# list of its own is needed to download for another system.
set -eu
cd "$(dirname "$0")/../.."
exec .venv/bin/uv pip compile --quiet --python-version 3.11 \
    --python-platform x86_64-pc-windows-msvc --only-binary :all: --generate-hashes \
    --no-emit-index-url --custom-compile-command installer/windows/lock.sh \
    -c requirements.lock pyproject.toml --extra gui --group build -o installer/windows/win_amd64.lock "$@"
