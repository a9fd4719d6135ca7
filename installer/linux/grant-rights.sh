#!/bin/sh
# Give the bus process of OCMM, and nothing else, the rights to talk to the cameras.
#
#   sudo installer/linux/grant-rights.sh                  for the group of whoever types this
#   sudo installer/linux/grant-rights.sh --group NAME     for another group
#   sudo installer/linux/grant-rights.sh --remove         take the rights back
#        installer/linux/grant-rights.sh --check          say how it stands; needs no root
#
#   --venv DIR    the Python environment of OCMM, if it is not .venv of this folder
#
# What it does: it copies the Python that the environment was made from to bin/ocmm-acq-python, gives
# the copy to root, lets only the group run it (mode 0750), and attaches three rights to it (setcap):
#   cap_net_raw     send and receive raw Ethernet frames
#   cap_net_admin   let the network adapter take every frame (promiscuous mode)
#   cap_sys_nice    real-time priority
# The environment may be that of an ordinary user. The Python that its links lead to must be one of
# the system: an executable of root in folders that only root can write, which everybody can read.
# So nobody gets rights for a program of his own, or a copy of a file that only root can read.
# The window uses the ordinary Python and has no rights. Run this again after an update of Python
# or of the environment; running it twice does no harm.
#
# What remains: everybody in the group can use these three rights with any Python program, which
# means to read and change the network traffic of this computer; they cannot become root by it.
# On the computer of a measuring cell, where the cameras are always connected, use the service
# instead: installer/linux/ocmm-acq@.service gives the rights to one user that nobody logs in as.
set -eu
PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C
export PATH LC_ALL

rights=cap_net_admin,cap_net_raw,cap_sys_nice
name=ocmm-acq-python

say() { printf 'ocmm: %s\n' "$*" >&2; }
fail() { say "$@"; exit 2; }
need() { command -v "$1" >/dev/null || fail "The program '$1' is missing. Install it: apt install $2"; }

here=$(cd -- "$(dirname -- "$0")/../.." && pwd -P)
venv=$here/.venv
group=
task=grant
while [ $# -gt 0 ]; do
    case $1 in
        --venv)   [ $# -ge 2 ] || fail "--venv needs a folder."; venv=$2; shift ;;
        --group)  [ $# -ge 2 ] || fail "--group needs a name."; group=$2; shift ;;
        --remove) task=remove ;;
        --check)  task=check ;;
        -h | --help) sed -n '2,/^set -eu/{/^set -eu/d;s/^# \{0,1\}//;p;}' "$0"; exit 0 ;;
        *) fail "There is no '$1'. See $0 --help" ;;
    esac
    shift
done

[ -d "$venv/bin" ] || fail "$venv is no Python environment. Make it (./run setup) or name it: --venv DIR"
venv=$(cd -- "$venv" && pwd -P)
target=$venv/bin/$name

check() {
    need getcap libcap2-bin
    if [ ! -e "$target" ]; then
        say "Not granted: there is no $target."
        return 1
    fi
    held=$(getcap "$target")
    # getcap prints nothing where the file has no rights.
    if [ "${held#"$target" }" = "$rights=ep" ] && [ "$(stat -c %u:%a "$target")" = 0:750 ]; then
        say "Granted to the group '$(stat -c %G "$target")': $target"
        return 0
    fi
    say "Not granted: $target is not as it should be ($(stat -c '%U:%G %a' "$target"), ${held:-no rights})."
    return 1
}

if [ "$task" = check ]; then
    check || exit 1
    exit 0
fi

[ "$(id -u)" -eq 0 ] || fail "This needs root, once. Type: sudo $0 $([ "$task" = grant ] || echo --remove)"

if [ "$task" = remove ]; then
    rm -f -- "$target"
    say "The rights are taken back; $target is gone."
    exit 0
fi

need setcap libcap2-bin
need findmnt util-linux
if [ -z "$group" ]; then
    [ -n "${SUDO_USER:-}" ] ||
        fail "Who may use the cameras? Name the group: $0 --group NAME"
    group=$(id -gn -- "$SUDO_USER")
fi
gid=$(getent group -- "$group" | cut -d: -f3)
[ -n "$gid" ] || fail "There is no group '$group'. Make it first: groupadd --system $group"
if findmnt -n -o OPTIONS -T "$venv/bin" | tr , '\n' | grep -qx nosuid; then
    fail "$venv lies on a file system that is mounted 'nosuid', where rights of files are ignored." \
        "Put OCMM into another folder, e.g. /opt/ocmm, or use the service (installer/linux)."
fi
# Followed through the links of the environment, which its owner can change at any time. The path
# found is then checked from the root folder on: only root can change what it means.
original=$(readlink -f -- "$venv/bin/python") || original=
[ -n "$original" ] || fail "$venv/bin/python leads nowhere. Make the environment again: ./run setup"
remedy="Make the environment from the Python of the system (PYTHON=/usr/bin/python3 ./run setup),"
remedy="$remedy or use the service (installer/linux/ocmm-acq@.service)."
case ${original##*/} in
    python3.[0-9] | python3.[0-9][0-9]) ;;
    *) fail "$venv/bin/python leads to $original, which is no Python of the system. $remedy" ;;
esac
part=$original
while :; do
    # The third word is the kind; links are not followed.
    state=$(stat -c '%u %a %F' -- "$part") || fail "$part: $original was removed meanwhile."
    case $state in
        "0 "*" regular file") [ "$part" = "$original" ] || fail "$part is no folder." ;;
        "0 "*" directory") [ "$part" != "$original" ] || fail "$part is no program. $remedy" ;;
        "0 "*) fail "$part is neither a file nor a folder. $remedy" ;;
        *) fail "$part does not belong to root. $remedy" ;;
    esac
    [ -z "$(find "$part" -maxdepth 0 -perm /022)" ] || fail "Others than root can write $part. $remedy"
    [ -n "$(find "$part" -maxdepth 0 -perm -001)" ] || fail "Only root can reach $part. $remedy"
    [ "$part" != / ] || break
    part=$(dirname -- "$part")
done
exec 3<"$original"
[ "$(readlink /proc/self/fd/3)" = "$original" ] && [ "$(stat -L -c '%u %F' /proc/self/fd/3)" = "0 regular file" ] &&
    [ -n "$(find -L /proc/self/fd/3 -maxdepth 0 -perm -005 ! -perm /022)" ] ||
    fail "$original is no program that everybody can read and only root can write. $remedy"

# The environment may belong to an ordinary user, who could put a link in the way of every path.
# So the work is done inside a folder of root's own, reached by no path, and moved at the end.
cd -- "$venv/bin" && [ "$(pwd -P)" = "$venv/bin" ] || fail "$venv/bin was changed meanwhile; nothing is done."
work=$venv/bin/$(basename -- "$(mktemp -d "./.$name-XXXXXX")")
cd -- "$work" && [ "$(pwd -P)" = "$work" ] && [ "$(stat -c %u:%a .)" = 0:700 ] && [ -z "$(ls -A .)" ] ||
    fail "$work was changed meanwhile; nothing is done."
trap 'rm -f -- "./$name"; rmdir -- "$work" 2>/dev/null || :' EXIT
umask 077
cat <&3 >"./$name"
[ "$(od -An -tx1 -N4 "./$name" | tr -d ' ')" = 7f454c46 ] || fail "$original is no executable (ELF). $remedy"
touch -r /proc/self/fd/3 -- "./$name"
exec 3<&-
chown "0:$gid" "./$name"
chmod 0750 "./$name"
# After the owner: a change of the owner takes rights away.
setcap "$rights=ep" "./$name"
mv -T -f -- "./$name" "../$name"
cd /

check || fail "The file system of $venv does not keep rights of files. Use the service instead (installer/linux)."
if [ -n "${SUDO_USER:-}" ]; then
    # As that user, since the proof is in the running.
    command -v runuser >/dev/null || exit 0
    seen=$(runuser -u "$SUDO_USER" -- "$target" -I -c \
        'import ocmm_core; print(next(l.split()[1] for l in open("/proc/self/status") if l.startswith("CapEff")))') ||
        fail "$SUDO_USER cannot run it. If the group is new, log out and in; see the line above for anything else."
    [ "$seen" = 0000000000803000 ] || fail "$SUDO_USER runs it with the rights $seen instead of 0000000000803000."
    say "$SUDO_USER can use it."
fi
