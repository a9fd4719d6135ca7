#!/bin/sh
# Measure the demonstration part on a 64-bit ARM, emulated by qemu-user, and compare all numbers with this computer.
#
#   installer/test_arm64.sh [--work DIR]
#
#   --work DIR   the root, which is kept and used again; default: a new folder
#
# It needs root, debootstrap, qemu-user-static, this clone set up (.venv), the network, 2 GB and about an hour. Only the
# core and the commands are installed: newer wheels of Qt for ARM need a newer system than Debian 12.
# The exit code is 1 where a number differs or the demonstration fails.
set -eu
umask 022

say() { printf 'test_arm64: %s\n' "$*" >&2; }
fail() { say "$@"; exit 2; }

here=$(cd -- "$(dirname -- "$0")/.." && pwd -P)
work=''
while [ $# -gt 0 ]; do
    case $1 in
        -h | --help) sed -n '2,/^set -eu/{/^set -eu/d;s/^# \{0,1\}//;p;}' "$0"; exit 0 ;;
        --work) [ $# -ge 2 ] || fail "$1 needs a value."; work=$2; shift 2 ;;
        *) fail "There is no '$1'. See $0 --help" ;;
    esac
done
[ "$(id -u)" -eq 0 ] || fail "This needs root: it makes a root and mounts what belongs into it."
for program in debootstrap qemu-aarch64-static; do
    command -v "$program" >/dev/null || fail "The program '$program' is missing."
done
[ -x "$here/.venv/bin/ocmm" ] || fail "This clone is not set up: ./run setup"
: "${work:=$(mktemp -d)}"
tree=$work/arm64
formats=/proc/sys/fs/binfmt_misc

[ -e $formats/register ] || mount -t binfmt_misc none $formats
# shellcheck disable=SC2028 # the kernel reads the escapes itself
[ -e $formats/qemu-aarch64 ] || printf '%s' ':qemu-aarch64:M::\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00:\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff:/usr/bin/qemu-aarch64-static:F' >$formats/register

if [ ! -e "$tree/srv/.made" ]; then
    say "making the root"
    debootstrap --arch=arm64 --variant=minbase --include=python3,python3-venv,ca-certificates,git,gcc,libc6-dev,python3-dev \
        bookworm "$tree" >"$work/debootstrap.log"
    touch "$tree/srv/.made"
fi
cp /etc/resolv.conf "$tree/etc/resolv.conf"
cp -r /etc/ssl/certs "$tree/etc/ssl/"
mountpoint -q "$tree/proc" || mount -t proc proc "$tree/proc"
mountpoint -q "$tree/dev/shm" || { mkdir -p "$tree/dev/shm"; mount -t tmpfs tmpfs "$tree/dev/shm"; }
trap 'umount "$tree/proc" "$tree/dev/shm"' EXIT

say "installing what the core needs, by the lock file"
rm -rf "$tree/srv/ocmm"
git clone -q "$here" "$tree/srv/ocmm"
# Each requirement is a paragraph that begins in the first column.
awk '/^[a-z0-9]/ { kept = !/^(pyside6|shiboken6|pyqtgraph|pysoem|python-pkcs11)/ } kept' \
    "$here/requirements.lock" >"$tree/srv/core.lock"
inside() { chroot "$tree" /usr/bin/env HOME=/srv OPENBLAS_NUM_THREADS=1 sh -c "$1"; }
inside 'cd /srv/ocmm && python3 -m venv .venv &&
    .venv/bin/pip install -q --no-deps --require-hashes -r /srv/core.lock &&
    .venv/bin/pip install -q --no-deps --no-build-isolation .'

say "measuring"
rm -rf "$tree/srv/ocmm-out" "$work/here"
mkdir -p "$work/here"
# 1: the part does not conform, which is a result as well.
(cd "$work/here" && OPENBLAS_NUM_THREADS=1 "$here/.venv/bin/ocmm" demo --headless --seed 7 >/dev/null) || [ $? -eq 1 ]
inside 'cd /srv && ocmm/.venv/bin/ocmm demo --headless --seed 7' || [ $? -eq 1 ]
different=0
for part in points features report; do
    one=DEMO-001_SIMULATED_$part.csv
    if cmp -s "$work/here/ocmm-out/$one" "$tree/srv/ocmm-out/$one"; then
        printf 'EQUAL      %s, %s lines\n' "$one" "$(wc -l <"$tree/srv/ocmm-out/$one")"
    else
        printf 'DIFFERENT  %s\n' "$one"
        different=1
    fi
done
exit $different
