#!/bin/sh
# Build the image of a station's disk: Debian with a real-time kernel, a read-only system, a
# partition for data, and the OCMM window on the screen from the start.
#
#   installer/station/build.sh --deb FILE [--out DIR] [--work DIR] [--suite bookworm] [--mirror URL]
#                              [--core N] [--keyboard LAYOUT] [--zone ZONE] [--password-hash FILE]
#                              [--firmware]
#
#   --deb FILE            the package of OCMM, see installer/build.sh
#   --out DIR             where ocmm-station.img and its SHA256SUMS go; default: dist of this folder
#   --work DIR            where is built; default: a new folder under TMPDIR, removed at the end
#   --suite NAME          release of Debian; others than bookworm were not tried
#   --mirror URL          of Debian; one of snapshot.debian.org makes the same packages come again
#   --core N              processor that the camera bus has for itself: the last one; default: 3
#   --keyboard LAYOUT     de, us, fr...; default: us
#   --zone ZONE           time zone; default: Etc/UTC
#   --password-hash FILE  of the technician (openssl passwd -6); default: asked at the first start
#   --firmware            add Debian's non-free firmware for network, graphics and processor
#
# It needs no root: mmdebstrap, mksquashfs 4.5 or newer, mkfs.vfat, mtools, mke2fs, sfdisk, some 6 GB.
# The date is that of the package: the same package, arguments and Debian packages give the same bytes
# but for what was not tried (README.md).
set -eu
umask 022
export LC_ALL=C.UTF-8 TZ=UTC

say() { printf 'station: %s\n' "$*" >&2; }
fail() { say "$@"; exit 2; }

here=$(cd -- "$(dirname -- "$0")" && pwd -P)
deb='' out=$here/../../dist work='' suite=bookworm mirror='' core=3 keyboard=us zone=Etc/UTC hash=''
components=main firmware=''
while [ $# -gt 0 ]; do
    case $1 in
        -h | --help) sed -n '2,/^set -eu/{/^set -eu/d;s/^# \{0,1\}//;p;}' "$0"; exit 0 ;;
        --firmware)
            components=main,non-free-firmware
            firmware=,firmware-linux-nonfree,firmware-realtek,intel-microcode,amd64-microcode
            shift
            continue ;;
        --deb | --out | --work | --suite | --mirror | --core | --keyboard | --zone | --password-hash)
            [ $# -ge 2 ] || fail "$1 needs a value." ;;
        *) fail "There is no '$1'. See $0 --help" ;;
    esac
    case $1 in
        --deb)           deb=$2 ;;
        --out)           out=$2 ;;
        --work)          work=$2 ;;
        --suite)         suite=$2 ;;
        --mirror)        mirror=$2 ;;
        --core)          core=$2 ;;
        --keyboard)      keyboard=$2 ;;
        --zone)          zone=$2 ;;
        --password-hash) hash=$2 ;;
    esac
    shift 2
done
PATH=$PATH:/usr/sbin:/sbin
for tool in mmdebstrap mksquashfs mkfs.vfat mcopy mke2fs sfdisk dpkg-deb; do
    command -v "$tool" >/dev/null || fail "The program '$tool' is missing."
done
[ -f "$deb" ] || fail "Which package? --deb FILE; installer/build.sh makes it."
case $core in '' | *[!0-9]* | 0) fail "--core is the number of a processor from 1 on, not '$core'." ;; esac
case $keyboard$zone in *[!A-Za-z0-9/_+-]*) fail "--keyboard and --zone are names such as de, Europe/Berlin." ;; esac
mkdir -p "$out"
out=$(cd -- "$out" && pwd -P)
if [ -z "$work" ]; then
    work=$(mktemp -d)
    trap 'rm -rf -- "$work"' EXIT
    trap 'exit 130' INT TERM
fi
mkdir -p "$work"
work=$(cd -- "$work" && pwd -P)
rm -rf -- "$work/boot" "$work/esp" "$work/efi" "$work/data" "$work/tree"
mkdir -p "$work/boot" "$work/esp/EFI/BOOT" "$work/esp/EFI/debian" "$work/esp/ocmm/a" "$work/efi" "$work/data"
SOURCE_DATE_EPOCH=$(dpkg-deb --ctrl-tarfile "$deb" | tar -tv --full-time -f - | head -n1 | awk '{print $4, $5}' |
    { read -r when; date --date="$when" +%s; })
export SOURCE_DATE_EPOCH

# 1. The system. Files of an image belong to root and are nobody else's to write.
say "Installing Debian $suite."
cp -r "$here/root" "$work/tree"
chmod -R u=rwX,go=rX "$work/tree"
cp "$deb" "$work/ocmm.deb"
# shellcheck disable=SC2016 # "$1" is the new root, for the shell of the hook
mmdebstrap --variant=minbase --components="$components" --format=tar \
    --include=linux-image-rt-amd64,systemd-sysv,systemd-timesyncd,udev,dbus,libpam-systemd,kmod,initramfs-tools,busybox,zstd,e2fsprogs \
    --include=xserver-xorg-core,xserver-xorg-input-libinput,xserver-xorg-video-fbdev,xinit,openbox,fonts-dejavu-core \
    --include=console-setup,keyboard-configuration,kbd,tzdata,alsa-utils,ethtool,iproute2,procps,psmisc,libcap2-bin,mtools \
    --include="sudo,passwd,login,less,vim-tiny,ca-certificates$firmware" \
    --aptopt='APT::Install-Recommends "false"' \
    --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-include=/usr/share/doc/*/copyright' \
    --customize-hook='chroot "$1" sh -c "cd /var/tmp && apt-get download -q shim-signed grub-efi-amd64-signed"' \
    --customize-hook="sync-out /var/tmp '$work/efi'" \
    --customize-hook="copy-in '$work/ocmm.deb' /tmp" \
    --customize-hook='chroot "$1" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y /tmp/ocmm.deb' \
    --customize-hook="sync-in '$work/tree' /" \
    --customize-hook="copy-in '$here/inside.sh' /tmp" \
    --customize-hook="chroot \"\$1\" sh /tmp/inside.sh '$core' '$keyboard' '$zone'" \
    --customize-hook="sync-out /boot '$work/boot'" \
    --customize-hook='rm -rf "$1"/boot/* "$1"/tmp/* "$1"/var/tmp/* "$1"/var/log/* "$1"/etc/resolv.conf' \
    "$suite" "$work/system.tar" ${mirror:+"$mirror"} >&2
say "Packing it."
rm -f "$work/system.squashfs"
mksquashfs - "$work/system.squashfs" -tar -root-mode 0755 -quiet -no-progress -comp zstd -Xcompression-level 3 -b 256K \
    <"$work/system.tar"

# 2. What the firmware starts: Debian's signed loader, so that Secure Boot may stay on. Nobody at
# the keyboard may change the command line: there is a superuser, and he has no password.
for package in "$work"/efi/*.deb; do
    dpkg-deb --extract "$package" "$work/efi"
done
cp "$work/efi/usr/lib/shim/shimx64.efi.signed" "$work/esp/EFI/BOOT/BOOTX64.EFI"
cp "$work/efi/usr/lib/grub/x86_64-efi-signed/grubx64.efi.signed" "$work/esp/EFI/BOOT/grubx64.efi"
cp "$here/grub.cfg" "$work/esp/EFI/debian/grub.cfg"
echo 'set default=a' >"$work/esp/ocmm/default.cfg"
cp "$work"/boot/vmlinuz-* "$work/esp/ocmm/a/vmlinuz"
cp "$work"/boot/initrd.img-* "$work/esp/ocmm/a/initrd.img"
sed "s/@CORE@/$core/g; s/@OTHERS@/0-$((core - 1))/; s/0-0/0/" "$here/arguments.cfg" >"$work/esp/ocmm/a/arguments.cfg"

# 3. The disk, in MiB: loader 256, system a and b 1536 each, data. station-update knows these numbers.
say "Putting the disk together."
find "$work/esp" -exec touch --date="@$SOURCE_DATE_EPOCH" {} +
rm -f "$work/esp.img" "$work/data.img" "$work/disk.img"
truncate -s 256M "$work/esp.img"
mkfs.vfat --invariant -F 32 -n OCMM-BOOT "$work/esp.img" >/dev/null
mcopy -i "$work/esp.img" -s -m "$work"/esp/* ::/
[ "$(stat -c %s "$work/system.squashfs")" -le $((1536 << 20)) ] || fail "The system is larger than its partition."
mkdir -p "$work/data/etc" "$work/data/home" "$work/data/journal" "$work/data/systemd"
if [ -n "$hash" ]; then
    (umask 077 && cp "$hash" "$work/data/technician.hash")
fi
truncate -s 512M "$work/data.img"
mke2fs -q -t ext4 -L ocmm-data -b 4096 -i 16384 -J size=64 -m 1 -U 0c3a7b1e-52a4-4b8e-9f4e-6f636d6d0004 \
    -E hash_seed=0c3a7b1e-52a4-4b8e-9f4e-6f636d6d0005,lazy_itable_init=0,lazy_journal_init=0,root_owner=0:0 \
    -d "$work/data" "$work/data.img"
if [ "$(id -u)" -ne 0 ]; then
    # mke2fs gives the files to who builds.
    for place in etc home journal systemd ${hash:+technician.hash}; do
        printf 'sif /%s uid 0\nsif /%s gid 0\n' "$place" "$place"
    done | debugfs -w -f - "$work/data.img" >/dev/null 2>&1
fi
image=$work/disk.img
truncate -s $((1 + 256 + 2 * 1536 + 512 + 1))M "$image"
sfdisk --quiet "$image" <<'TABLE'
label: gpt
label-id: 0C3A7B1E-52A4-4B8E-9F4E-6F636D6D0000
unit: sectors
start=1MiB,    size=256MiB,  type=uefi,                                 name=ocmm-boot
start=257MiB,  size=1536MiB, type=4F68BCE3-E8CD-4DB1-96E7-FBCAF984B709, name=ocmm-a
start=1793MiB, size=1536MiB, type=4F68BCE3-E8CD-4DB1-96E7-FBCAF984B709, name=ocmm-b
start=3329MiB, size=512MiB,  type=linux,                                name=ocmm-data
TABLE
place() { dd if="$1" of="$image" bs=1M seek="$2" conv=notrunc,sparse status=none; }
place "$work/esp.img" 1
place "$work/system.squashfs" 257
place "$work/data.img" 3329
mv "$image" "$out/ocmm-station.img"
(cd "$out" && sha256sum ocmm-station.img >SHA256SUMS.station && cat SHA256SUMS.station)
