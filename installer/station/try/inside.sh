#!/bin/sh
# In the station under trial: what is told goes to the second serial port, which try.sh reads.
exec >/dev/ttyS1 2>&1
as_inspector() { runuser -u inspector -- env HOME=/home/inspector sh -c "cd && $*"; }
heading() { printf '\n== %s\n' "$*"; }
# The brackets keep grep from finding itself.
window() { grep -sla '[o]cmm_gui' /proc/[0-9]*/cmdline | head -n 1 | cut -d/ -f3; }

heading "start $(cat /data/try.starts 2>/dev/null | wc -l), up for $(cut -d. -f1 /proc/uptime) s"
uname -srv
cat /proc/cmdline
for place in / /etc /var /data /home /tmp; do findmnt -rno TARGET,FSTYPE,OPTIONS "$place"; done
df -h /data | tail -n 1
cat /etc/machine-id

heading "units"
systemctl is-system-running
systemctl --failed --no-legend --plain
systemctl is-active ocmm-window.service ocmm-acq.socket ocmm-tune.service ocmm-key.service ocmm-technician.service
systemctl is-enabled getty@tty1.service

heading "read-only"
touch /opt/ocmm/x /usr/x /x
getcap /opt/ocmm/ocmm-acq

heading "nobody listens"
cat /proc/net/tcp /proc/net/udp /proc/net/tcp6 /proc/net/udp6 | grep -v local_address

heading "key"
as_inspector ocmm key show

heading "window"
for _ in $(seq 60); do
    [ -z "$(window)" ] || break
    sleep 5
done
tr '\0' ' ' <"/proc/$(window)/cmdline"
# Until it has drawn itself, on a computer that may be emulated.
sleep 120
echo PICTURE
sleep 15

heading "doctor"
# Through a pipe: this place counts as a terminal, on which progress is drawn.
{ as_inspector ocmm station doctor --interface enp0s16 --seconds 12; echo "exit $?"; } 2>&1 | cat

sh /etc/try/then.sh

if [ ! -e /data/try.starts ]; then
    heading "the window comes back"
    before=$(window)
    kill "$before"
    sleep 30
    echo "was $before, is $(window)"
    echo 1 >>/data/try.starts
    sync
    systemctl reboot
else
    heading "journal, errors"
    journalctl -b -p err --no-pager | tail -n 30
    journalctl --list-boots --no-pager | wc -l
    echo TRIED
    systemctl poweroff
fi
