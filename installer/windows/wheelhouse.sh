#!/bin/sh
# Fills a folder with all that OCMM needs on 64-bit Windows with Python 3.11, for a computer without
# a network. NEVER RUN ON WINDOWS: what is in the folder was only downloaded.
set -eu
if [ $# -ne 1 ]; then
    echo "Usage: $0 FOLDER (outside the repository)" >&2
    exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
mkdir -p "$1"
folder=$(cd "$1" && pwd)
case $folder/ in
"$root"/*)
    echo "$folder is in the repository, which holds no packages. Give another folder." >&2
    exit 2
    ;;
esac
python=${PYTHON:-$root/.venv/bin/python}
"$python" -m pip --disable-pip-version-check download --quiet --require-hashes \
    --only-binary=:all: --platform win_amd64 --implementation cp --python-version 3.11 \
    --abi cp311 --abi abi3 --abi none --no-deps -r "$here/win_amd64.lock" -d "$folder"
# Of what is committed, and beside the repository: an old build folder would get into the wheel.
source=$(mktemp -d)
trap 'rm -rf "$source"' EXIT
git -C "$root" archive HEAD | tar -x -C "$source"
"$python" -m pip --disable-pip-version-check wheel --quiet --no-deps --no-build-isolation \
    -w "$folder" "$source"
cp "$here/win_amd64.lock" "$here/install.ps1" "$folder/"
echo "$folder: $(find "$folder" -name '*.whl' | wc -l) wheels"
