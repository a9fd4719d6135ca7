#!/bin/sh
# Inside the new system, after its packages and the files of `root` are there; build.sh runs it.
#
#   inside.sh CORE KEYBOARD ZONE
set -eu
core=$1 keyboard=$2 zone=$3

# Fixed numbers: what they own on the data partition outlives an image.
useradd --uid 1000 --user-group --groups ocmm,audio,video --no-create-home --shell /usr/sbin/nologin \
    --comment "Inspector" inspector
useradd --uid 1001 --user-group --groups ocmm,sudo,adm --no-create-home --shell /bin/bash \
    --comment "Technician" technician
passwd --lock root

mkdir -p /data /volatile /etc/ocmm "/etc/systemd/system/ocmm-acq@.service.d"
# Ordinary processes are kept off this processor, the bus process is put on it.
printf '[Service]\nCPUAffinity=%s\n' "$core" >"/etc/systemd/system/ocmm-acq@.service.d/core.conf"
sed -i "s/^XKBLAYOUT=.*/XKBLAYOUT=\"$keyboard\"/" /etc/default/keyboard
[ -e "/usr/share/zoneinfo/$zone" ] || { echo "There is no time zone '$zone'." >&2; exit 2; }
ln -sf "/usr/share/zoneinfo/$zone" /etc/localtime
echo "$zone" >/etc/timezone
echo ocmm-station >/etc/hostname
printf '127.0.0.1 localhost\n127.0.1.1 ocmm-station\n' >/etc/hosts

systemctl enable ocmm-acq.socket ocmm-tune.service ocmm-key.service ocmm-technician.service \
    ocmm-window.service systemd-networkd.service
systemctl disable getty@tty1.service systemd-networkd-wait-online.service
systemctl mask ctrl-alt-del.target sleep.target suspend.target hibernate.target apt-daily.timer \
    apt-daily-upgrade.timer
update-initramfs -u -k all

# Nothing that is another one in the next image, and no identity.
: >/etc/machine-id
rm -rf /var/lib/dbus/machine-id /var/cache/ldconfig /etc/*- /var/lib/systemd/random-seed
