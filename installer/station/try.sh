#!/bin/sh
# Start the image in QEMU, look at the screen, and ask the doctor, twice with a restart between.
#
#   installer/station/try.sh --image FILE [--work DIR] [--minutes N] [--accelerate ACCELERATOR] [--then FILE]
#
#   --image FILE              ocmm-station.img
#   --work DIR                the copy that is started, pictures and what was said; default: a new folder
#   --minutes N               how long at most; default: 60
#   --accelerate ACCELERATOR  kvm or tcg; default: kvm where it can be used
#   --then FILE               a shell script that is run in the station as root, too
#
# It needs no root: qemu-system-x86, ovmf, debugfs. The image has no way in for tests: what is tried
# is put on the data partition of the copy, as a technician puts settings there.
set -eu
say() { printf 'try: %s\n' "$*" >&2; }
fail() { say "$@"; exit 2; }

image='' work='' minutes=60 accelerate='' then=''
while [ $# -gt 0 ]; do
    case $1 in
        -h | --help) sed -n '2,/^set -eu/{/^set -eu/d;s/^# \{0,1\}//;p;}' "$0"; exit 0 ;;
        --image | --work | --minutes | --accelerate | --then) [ $# -ge 2 ] || fail "$1 needs a value." ;;
        *) fail "There is no '$1'. See $0 --help" ;;
    esac
    case $1 in
        --image)      image=$2 ;;
        --work)       work=$2 ;;
        --minutes)    minutes=$2 ;;
        --accelerate) accelerate=$2 ;;
        --then)       then=$2 ;;
    esac
    shift 2
done
here=$(cd -- "$(dirname -- "$0")" && pwd -P)
PATH=$PATH:/usr/sbin:/sbin
[ -f "$image" ] || fail "Which image? --image FILE; installer/station/build.sh makes it."
for tool in qemu-system-x86_64 debugfs; do
    command -v "$tool" >/dev/null || fail "The program '$tool' is missing."
done
: "${work:=$(mktemp -d)}"
mkdir -p "$work"
work=$(cd -- "$work" && pwd -P)
if [ -z "$accelerate" ]; then
    accelerate=tcg
    [ ! -w /dev/kvm ] || accelerate=kvm
fi

# The copy is on a larger disk than the image, as on a real computer.
say "Preparing the disk."
rm -f "$work/disk.img" "$work/monitor" "$work"/*.png "$work/said.txt" "$work/serial.txt"
cp --sparse=always "$image" "$work/disk.img"
truncate -s +2G "$work/disk.img"
# Nobody can log in with it.
echo '*' >"$work/technician.hash"
echo 'OCMM_INTERFACE=enp0s16' >"$work/bus.env"
cp "${then:-/dev/null}" "$work/then.sh"
{
    for place in etc/systemd etc/systemd/system etc/systemd/system/multi-user.target.wants etc/ocmm etc/try; do
        echo "mkdir /$place"
    done
    echo "write $here/try/try.service /etc/systemd/system/try.service"
    echo "symlink /etc/systemd/system/multi-user.target.wants/try.service ../try.service"
    echo "write $here/try/inside.sh /etc/try/inside.sh"
    echo "write $work/then.sh /etc/try/then.sh"
    echo "write $work/bus.env /etc/ocmm/bus.env"
    echo "write $work/technician.hash /technician.hash"
} | debugfs -w -f - "$work/disk.img?offset=$((3329 << 20))" >"$work/debugfs.txt" 2>&1
cp /usr/share/OVMF/OVMF_VARS_4M.fd "$work/vars.fd"
mkfifo "$work/monitor"

say "Starting it ($accelerate)."
processor=max
[ "$accelerate" = tcg ] || processor=host
: >"$work/said.txt"
nice -n 10 qemu-system-x86_64 -machine q35 -accel "$accelerate" -cpu "$processor" -smp 4 -m 2048 \
    -drive if=pflash,format=raw,readonly=on,file=/usr/share/OVMF/OVMF_CODE_4M.fd \
    -drive if=pflash,format=raw,file="$work/vars.fd" \
    -drive if=none,id=disk,format=raw,file="$work/disk.img" -device ahci,id=ahci -device ide-hd,drive=disk,bus=ahci.0 \
    -netdev user,id=cameras,restrict=on -device e1000e,netdev=cameras,addr=0x10 \
    -audiodev none,id=sound -device intel-hda -device hda-output,audiodev=sound \
    -vga std -display none -serial file:"$work/serial.txt" -serial file:"$work/said.txt" \
    -monitor stdio <"$work/monitor" >"$work/monitor.txt" 2>&1 &
machine=$!
exec 3>"$work/monitor"
trap 'kill $machine 2>/dev/null || :; exec 3>&-; rm -f "$work/monitor"' EXIT
trap 'exit 130' INT TERM

picture() { printf 'screendump %s/%s.png -f png\n' "$work" "$1" >&3; }
begun=$(date +%s) shown=0 number=0
while kill -0 "$machine" 2>/dev/null; do
    sleep 5
    passed=$(($(date +%s) - begun))
    [ "$passed" -lt $((60 * minutes)) ] || fail "It did not come to an end in $minutes minutes: $work"
    # The station asks for a picture by a line of its own.
    asked=$(grep -c '^PICTURE' "$work/said.txt") || :
    if [ "$asked" -gt "$number" ]; then
        number=$asked
        picture "asked-$number"
    fi
    if [ $((passed / 60)) -gt "$shown" ]; then
        shown=$((passed / 60))
        picture "$(printf 'minute-%02d' "$shown")"
    fi
done
say "It ended after $passed s. Pictures and what was said: $work"
cat "$work/said.txt"
grep -q '^TRIED' "$work/said.txt"
