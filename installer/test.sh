#!/bin/sh
# Try the packages in clean roots: installed, used, upgraded, killed, removed, purged, installed again.
#
#   installer/test.sh [--from COMMIT | --deb FILE] [--newer FILE] [--suites "bookworm trixie noble resolute"] [--kills N]
#                     [--rounds N] [--starts N] [--quick] [--twice] [--ubuntu-keys FILE] [--work DIR]
#
#   --deb FILE          the package, with what was built beside it; default: built from the last commit
#                       (installer/build.sh)
#   --newer FILE        the same with a higher version number; default: made from that one
#   --from COMMIT       build the older package from the history, by the installer/build.sh of that commit, and
#                       write files of each kind with it (tests/golden/write.py); --newer is then the package
#                       of the last commit. In a folder of --work both are built once
#   --suites LIST       releases of Debian and Ubuntu; a root that cannot be made is NOT RUN
#   --kills N           moments at which dpkg is killed while it upgrades; default 20
#   --rounds N          how often it is installed, used, upgraded, removed and purged; default 1
#   --starts N          how often the window is started cold and warm; default 5
#   --quick             without bus, windows, archive for other distributions, wheel and kills
#   --twice             build two more times, in different folders, and compare the bytes
#   --ubuntu-keys FILE  the keys of Ubuntu's archive; default: those of the package ubuntu-keyring
#   --work DIR          roots and what was seen, pictures too; default: a new folder, which stays
#
# It needs root, mmdebstrap and some 3 GB. Each line says what was tried: PASSED, FAILED or NOT RUN.
# The exit code is 1 where anything failed. Numbers are compared with those of this clone, where it is
# set up (.venv).
# shellcheck disable=SC2317,SC2016 # functions are named to `verdict`; dpkg-query reads its own ${}
set -u
umask 022

say() { printf 'test: %s\n' "$*" >&2; }
fail() { say "$@"; exit 2; }

here=$(cd -- "$(dirname -- "$0")" && pwd -P)
deb='' from='' newer='' work='' twice='' quick=''
suites="bookworm trixie noble resolute" kills=20 rounds=1 starts=5
ubuntu_keys=/usr/share/keyrings/ubuntu-archive-keyring.gpg
clone=$here/../.venv/bin/ocmm
while [ $# -gt 0 ]; do
    case $1 in
        -h | --help) sed -n '2,/^set -u/{/^set -u/d;s/^# \{0,1\}//;p;}' "$0"; exit 0 ;;
        --twice) twice=yes && shift && continue ;;
        --quick) quick=yes && shift && continue ;;
        --deb | --from | --newer | --suites | --kills | --rounds | --starts | --ubuntu-keys | --work) [ $# -ge 2 ] || fail "$1 needs a value." ;;
        *) fail "There is no '$1'. See $0 --help" ;;
    esac
    case $1 in
        --deb)    deb=$(readlink -f "$2") ;;
        --from)   from=$2 ;;
        --newer)  newer=$(readlink -f "$2") ;;
        --suites) suites=$2 ;;
        --kills)  kills=$2 ;;
        --rounds) rounds=$2 ;;
        --starts) starts=$2 ;;
        --ubuntu-keys) ubuntu_keys=$(readlink -f "$2") ;;
        --work)   work=$2 ;;
    esac
    shift 2
done
[ "$(id -u)" -eq 0 ] || fail "This needs root: it makes roots and mounts what belongs into them."
command -v mmdebstrap >/dev/null || fail "The program 'mmdebstrap' is missing."
: "${work:=$(mktemp -d)}"
mkdir -p "$work"
work=$(cd -- "$work" && pwd -P)
mkdir -p "$work/seen"
built() {
    [ -f "$work/built/SHA256SUMS" ] || "$here/build.sh" --out "$work/built" --work "$work/building" >&2 ||
        fail "The package was not built."
    ls "$work"/built/*.deb
}
built_from() {
    commit=$(git -C "$here" rev-parse --verify --quiet "$1^{commit}") ||
        fail "This clone does not contain '$1'. git fetch --unshallow --tags completes its history."
    if [ ! -f "$work/$commit/SHA256SUMS" ]; then
        git -C "$here" worktree add --quiet --force --detach "$work/tree" "$commit" >&2 || exit 2
        "$work/tree/installer/build.sh" --out "$work/$commit" >&2
        git -C "$here" worktree remove --force "$work/tree"
    fi
    [ -f "$work/$commit/SHA256SUMS" ] || fail "The package of $1 was not built."
    ls "$work/$commit"/*.deb
}
if [ -n "$from" ]; then
    deb=$(built_from "$from") || exit 2
    [ -n "$newer" ] || newer=$(built) || exit 2
fi
[ -n "$deb" ] || deb=$(built) || exit 2
# What was built says which version it is.
version=$(dpkg-deb -f "$deb" Version | cut -d- -f1)
if [ -z "$newer" ]; then
    newer=$work/ocmm_99.0_amd64.deb
    rm -rf "$work/newer"
    dpkg-deb -R "$deb" "$work/newer"
    sed -i 's/^Version: .*/Version: 99.0/' "$work/newer/DEBIAN/control"
    core=$work/newer/opt/ocmm/_internal/ocmm_core
    sed -i 's/^__version__ = .*/__version__ = "99.0"/' "$core/__init__.py"
    rm -f "$core"/__pycache__/__init__.*
    (cd "$work/newer" && find opt usr -type f -print0 | xargs -0 md5sum) >"$work/md5sums"
    mv "$work/md5sums" "$work/newer/DEBIAN/"
    dpkg-deb --root-owner-group -Zzstd -z1 --build "$work/newer" "$newer" >&2 || fail "No newer package."
    rm -rf "$work/newer"
fi

failed=0 suite=all
# verdict NAME COMMAND...: one line; what the command printed is kept. Exit code 77: it was not tried.
verdict() {
    name=$1
    shift
    "$@" >"$work/seen/$suite-$name.txt" 2>&1
    case $? in
        0) printf 'PASSED   %s %s%s\n' "$suite" "$name" "$(said)" ;;
        77) printf 'NOT RUN  %s %s%s\n' "$suite" "$name" "$(said)" ;;
        *)
            printf 'FAILED   %s %s%s (%s)\n' "$suite" "$name" "$(said)" "$work/seen/$suite-$name.txt"
            failed=1
            return 1
            ;;
    esac
}
# What a check has to say in its line.
said() { sed -n 's/^SAID//p' "$work/seen/$suite-$name.txt" | tr -d '\n'; }
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 "$@"; }
# as USER COMMAND: at home, without root.
as() {
    user=$1
    shift
    inside runuser -u "$user" -- env HOME="/home/$user" USER="$user" sh -c "cd /home/$user && $*"
}

close_root() {
    for place in dev/shm dev/pts dev proc sys; do
        umount -l "$root/$place" 2>/dev/null || :
    done
}
open_root() {
    mkdir -p "$root"
    case $suite in
        noble | resolute) components=main,universe keys=$ubuntu_keys ;;
        *) components=main keys=/usr/share/keyrings/debian-archive-keyring.gpg ;;
    esac
    if [ ! -f "$work/$suite.tar" ]; then
        mmdebstrap --variant=minbase --components="$components" --keyring="$keys" \
            --include=apt,ca-certificates,xvfb,x11-apps,x11-utils,xauth,man-db,bash-completion,systemd,strace \
            "$suite" "$work/$suite.tar" >"$work/seen/$suite-root.txt" 2>&1 || return 1
    fi
    tar -C "$root" -xpf "$work/$suite.tar"
    for place in proc sys dev dev/pts; do
        mkdir -p "$root/$place"
        mount --bind "/$place" "$root/$place"
    done
    mount -t tmpfs -o mode=1777 shm "$root/dev/shm"
    # The host's sources and certificates of programs that fetch packages.
    cp /etc/resolv.conf "$root/etc/" 2>/dev/null || :
    for place in /etc/apt/apt.conf.d/*proxy* /etc/apt/apt.conf.d/*registry* /etc/ssl/certs; do
        [ ! -e "$place" ] || cp -rL "$place" "$root${place%/*}/" 2>/dev/null || :
    done
    cp "$deb" "$root/old.deb"
    cp "$newer" "$root/newer.deb"
    printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
    chmod 0755 "$root/usr/sbin/policy-rc.d"
    inside useradd --create-home --shell /bin/sh tester
}

install_it() {
    inside apt-get update -q &&
        inside env DEBIAN_FRONTEND=noninteractive SUDO_USER=tester \
            apt-get install -q -y --no-install-recommends "$1" &&
        inside usermod -aG ocmm tester
}
rights() {
    [ "$(inside getcap /opt/ocmm/ocmm-acq)" = \
        "/opt/ocmm/ocmm-acq cap_net_admin,cap_net_raw,cap_sys_nice=ep" ] || return 1
    [ "$(inside stat -c %U:%G:%a /opt/ocmm/ocmm-acq)" = root:ocmm:750 ] || return 1
    # Nobody but root may change what a program with rights loads, and nothing else has any.
    [ -z "$(find "$root/opt/ocmm" ! -type l \( -perm /022 -o ! -user 0 \))" ] || return 1
    [ "$(inside getcap -r /opt/ocmm | wc -l)" = 1 ] || return 1
    # Who is not in the group does not even start it.
    ! inside runuser -u nobody -- /opt/ocmm/ocmm-acq /nowhere 2>/dev/null
}
key_is_there() { [ -f "$root/home/tester/.local/share/ocmm/keys/station.key" ]; }
measures() {
    as tester "ocmm demo --headless --out $1 >$1.txt"
    code=$?
    cat "$root/home/tester/$1.txt"
    [ "$code" -le 1 ]
}
# What a demo says, without times, names of the run, hashes and signatures: `printed FOLDER` what its
# files print, `exact FOLDER` all numbers as the computer has them.
printed() {
    for file in "$1"/first/*_features.csv "$1"/first/*_points.csv "$1"/first/*_report.csv "$1"/first/*_cloud.asc; do
        echo "${file##*/}"
        cat "$file"
    done
}
exact() {
    for file in "$1"/numbers/*[A-Z].json; do
        echo "${file##*/}"
        # A report names its own number, the time and the head of the chain as values, too.
        sed -E -e 's/"([a-z_]*uuid|[a-z_]*utc|head|key|line|sha256|software_version|measured_with|written_with|seconds)": "[^"]*"//g' \
            -e 's/OCMM [0-9][0-9.]*(\+g[0-9a-z.]*)?//g' \
            -e 's/"value": "([0-9]{4}-[0-9-]{5} [0-9:]{8}|step [0-9]+, [0-9a-f]{16}|.*-[0-9a-f]{8}-[0-9]+)"//' "$file"
    done
}
# like_the_clone FOLDER: what is printed is the same, and so are the numbers; kernels for another
# processor may add in another order, which moves the last bits of a number that no file prints.
like_the_clone() {
    for one in printed exact; do
        $one "$work/clone" >"$work/seen/clone-$one.txt"
        $one "$1" >"$work/seen/$suite-$one.txt"
    done
    diff "$work/seen/clone-printed.txt" "$work/seen/$suite-printed.txt" || return 1
    for one in clone "$suite"; do
        number='-?[0-9]+\.[0-9]+(e-?[0-9]+)?'
        grep -oE -e "$number" "$work/seen/$one-exact.txt" >"$work/seen/$one-numbers.txt"
        sed -E "s/$number/N/g" "$work/seen/$one-exact.txt" >"$work/seen/$one-words.txt"
    done
    diff "$work/seen/clone-words.txt" "$work/seen/$suite-words.txt" || return 1
    paste "$work/seen/clone-numbers.txt" "$work/seen/$suite-numbers.txt" | awk '
        { count++ }
        $1 != $2 { off = $1 - $2; size = $1 < 0 ? -$1 : $1; if (off < 0) off = -off
                   if (off > 1e-12 * size + 1e-15) { print; wrong++ } else near++ }
        END { printf "SAID: files the same, %d of %d numbers to the last bit\n", count - near - wrong, count
              exit (wrong > 0 || count < 1000) }'
}
clone_measures() {
    [ ! -d "$work/clone/numbers" ] || return 0
    [ -x "$clone" ] || return 77
    mkdir -p "$work/clone"
    for words in "demo --headless --out first" "report first/DEMO-001.ocmm --format json --out numbers"; do
        # shellcheck disable=SC2086 # words
        (cd "$work/clone" && env -i HOME="$work/clone" PATH=/usr/bin:/bin LANG=C.UTF-8 "$clone" $words)
        [ $? -le 1 ] || return 1
    done
}
same_numbers_as_the_clone() {
    clone_measures || return
    as tester "rm -rf numbers; ocmm report first/*.ocmm --format json --out numbers"
    [ $? -le 1 ] || return 1
    like_the_clone "$root/home/tester"
}
measures_again() {
    as tester "rm -rf quick; ocmm measure --plan /opt/ocmm/_internal/ocmm_core/resources/plans/quick.toml \
        --out quick --seed 3 --speed 0"
    [ $? -le 1 ] && ls "$root"/home/tester/quick/*.ocmm
}
measures_on_the_wire() {
    # Whoever is in a changed root may have no private network; in a root of his own he may.
    # shellcheck disable=SC2016 # for the inner shell
    unshare --mount sh -c 'mount --rbind "$0" "$0" && cd "$0" && mkdir -p old-root &&
        pivot_root . old-root && umount -l old-root && exec runuser -u tester -- env -i \
        PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/home/tester LANG=C.UTF-8 sh -c "cd && exec ocmm measure \
        --source ethercat:virtual --plan /opt/ocmm/_internal/ocmm_core/resources/plans/quick.toml --out wire"' \
        "$root"
    [ $? -le 1 ]
}
bus_has_its_rights() {
    # It says what is wrong with the interface, not that it may not.
    as tester "echo '{}' >c.json; ocmm-acq c.json"
    [ $? -eq 2 ]
}
window() {
    as tester "xvfb-run -a -s '-screen 0 1280x720x24' ocmm -m ocmm_gui $1 --silent --speed 0 --out seen \
        --size 1280x720 --quit-after 12 --screenshot window.png" || return 1
    cp "$root/home/tester/window.png" "$work/seen/$suite-window$2.png"
}
# end SIGNAL PATTERN: what runs in this root alone.
end() {
    for process in $(pgrep -f "$2"); do
        [ "$(readlink "/proc/$process/root")" != "$root" ] || kill "-$1" "$process"
    done
}
# started OPTION: the time until the window is on the screen, in ms.
started() {
    t0=$(date +%s%N)
    as tester "DISPLAY=:77 exec ocmm -m ocmm_gui $1 --silent --speed 0 --out starts --size 1280x720 \
        --quit-after 60" >/dev/null 2>&1 &
    waited=0
    until inside xwininfo -display :77 -root -tree 2>/dev/null | sed -n 's/^ *\(0x[0-9a-f]*\) .* 1280x720+.*/\1/p' |
        while read -r id; do inside xwininfo -display :77 -id "$id"; done | grep -q IsViewable; do
        waited=$((waited + 1))
        [ "$waited" -lt 1000 ] || return 1
        sleep 0.02
    done
    echo $((($(date +%s%N) - t0) / 1000000))
    end TERM '^([^ ]*/)?ocmm -m ocmm_gui'
    wait $!
    :
}
# starts_in_time OPTION: cold and warm, by the icon (--start) or measuring at once.
starts_in_time() {
    inside Xvfb :77 -screen 0 1400x900x24 -ac >/dev/null 2>&1 &
    sleep 2
    : >"$work/cold" >"$work/warm"
    for one in $(seq 1 "$starts"); do
        sync
        echo 3 >/proc/sys/vm/drop_caches
        started "$1" >>"$work/cold"
        started "$1" >>"$work/warm"
    done
    end TERM '^Xvfb :77'
    cold=$(sort -n "$work/cold" | sed -n "$(((starts + 1) / 2))p")
    warm=$(sort -n "$work/warm" | sed -n "$(((starts + 1) / 2))p")
    load=$(cut -d' ' -f1 /proc/loadavg)
    echo "cold: $(tr '\n' ' ' <"$work/cold")ms; warm: $(tr '\n' ' ' <"$work/warm")ms"
    echo "SAID: cold $cold ms of 3000, warm $warm ms of 2000, medians of $starts; load $load"
    [ -n "$cold" ] && [ -n "$warm" ] || return 1
    [ "$cold" -le 3000 ] && [ "$warm" -le 2000 ] && return 0
    # On a computer that is busy with something else it says nothing.
    [ "${load%.*}" -lt "$(nproc)" ] || return 77
    return 1
}
tar_runs() {
    tar=${deb%/*}/ocmm-$version-linux-amd64.tar.xz
    [ -f "$tar" ] || return 77
    rm -rf "$root/home/tester/unpacked"
    mkdir "$root/home/tester/unpacked"
    tar -C "$root/home/tester/unpacked" --strip-components=1 -xf "$tar"
    as tester "unpacked/ocmm --version && unpacked/ocmm measure --out from-tar --seed 3 --speed 0 --plan \
        /opt/ocmm/_internal/ocmm_core/resources/plans/quick.toml"
    [ $? -le 1 ] || return 1
    rm -rf "$root/home/tester/unpacked"
}
nothing_compiles() {
    as tester "ocmm compile --processes 1" | tee /dev/stderr | grep -q ', 0 were compiled now'
}
pages() {
    inside man -w ocmm && inside man -w ocmm-acq || [ "$keys" = "$ubuntu_keys" ] || return 1
    as tester "_OCMM_COMPLETE=complete_bash COMP_WORDS='ocmm me' COMP_CWORD=1 ocmm" | grep -qx measure
}
same_bytes() { (cd "$root/home/tester" && sha256sum --quiet -c "$work/seen/$suite.sums"); }
keep_sums() {
    (cd "$root/home/tester" &&
        find first stations .local/share/ocmm -type f -print0 | sort -z | xargs -0 sha256sum) >"$work/seen/$suite.sums"
}
reads_the_old_job() {
    as tester "ocmm audit verify first/*.ocmm" && as tester "ocmm report first/*.ocmm --format json --out again"
    [ $? -le 1 ]
}
is_newer() {
    [ "$(inside dpkg-query -W -f='${Version}' ocmm)" = "$(dpkg-deb -f "$newer" Version)" ] || return 1
    # Builds of one version differ in their commit; only a version that is released names none.
    case $(inside ocmm --version | tee "$work/seen/newer.txt") in
        "ocmm $(dpkg-deb -f "$newer" Version | cut -d- -f1)"*) ! cmp "$work/seen/older.txt" "$work/seen/newer.txt" ;;
        *) false ;;
    esac
}
# By the command of README.md.
upgrade() {
    inside ocmm --version >"$work/seen/older.txt"
    inside env DEBIAN_FRONTEND=noninteractive SUDO_USER=tester \
        apt-get install -q -y --no-install-recommends /newer.deb && is_newer
}
# The older package is refused with a sentence, and the newer one stays as it was. Packages that
# cannot refuse yet (until 0.2.0) replace it after a sentence, and nothing is lost.
refuses_downgrade() {
    ! inside apt-get install -q -y --no-install-recommends /old.deb >"$work/seen/downgrade.txt" 2>&1 || return 1
    grep 'downgraded' "$work/seen/downgrade.txt" && is_newer || return 1
    inside dpkg -i /old.deb >"$work/seen/downgrade.txt" 2>&1
    code=$?
    cat "$work/seen/downgrade.txt"
    if dpkg-deb -I "$deb" preinst | grep -q 'remove it first'; then
        [ "$code" -ne 0 ] && grep -q 'remove .* first (apt-get remove ocmm)' "$work/seen/downgrade.txt" || return 1
    else
        echo "SAID: the older package cannot refuse; its user is told and nothing is lost"
        grep -q 'is older than .*settings stay' "$work/seen/downgrade.txt" && same_bytes &&
            inside ocmm --version | cmp - "$work/seen/older.txt" && older_answers && same_bytes && upgrade || return 1
    fi
    [ "$(inside dpkg-query -W -f='${Status}' ocmm)" = "install ok installed" ] && is_newer && rights
}
remove() { inside dpkg -r ocmm && [ ! -e "$root/opt/ocmm" ] && [ ! -e "$root/usr/bin/ocmm" ]; }
purge() {
    inside dpkg -P ocmm | tee "$work/seen/purge.txt"
    inside dpkg -P ocmm 2>&1 | cat
    [ ! -e "$root/etc/ocmm" ] && [ ! -e "$root/opt/ocmm" ]
}

# The installed program in a folder of a station, as its user, with the home that is in that folder:
# what tests/golden/write.py runs as `ocmm`.
station_program() {
    mkdir -p "$work/bin"
    cat >"$work/bin/ocmm" <<END
#!/bin/sh
here=\$(pwd -P)
chown -R --reference="$root/home/tester" "$root/home/tester/stations"
export HOME="\${here#"$root"}"
exec chroot --userspec=tester:tester "$root" /usr/bin/env -i PATH=/usr/bin:/bin LANG=C.UTF-8 HOME="\$HOME" \\
    XDG_CONFIG_DIRS="\$HOME/home/xdg_config_dirs" XDG_CONFIG_HOME="\$HOME/home/xdg_config_home" \\
    XDG_DATA_HOME="\$HOME/home/xdg_data_home" XDG_STATE_HOME="\$HOME/home/xdg_state_home" \\
    /bin/sh -c 'cd && exec ocmm "\$@"' sh "\$@"
END
    chmod 0755 "$work/bin/ocmm"
}
writes_files() {
    station_program
    mkdir -p "$root/home/tester/stations"
    PATH=$work/bin:$PATH "${PYTHON:-python3}" -B "$here/../tests/golden/write.py" "$root/home/tester/stations/old" 
}
# opens STATION CODES PATTERN WORDS...: a command on files that another version wrote.
opens() {
    place=$root/home/tester/stations/old/$1 codes=$2 pattern=$3
    shift 3
    opened=$((opened + 1))
    answer=$(cd "$place" && "$work/bin/ocmm" "$@" </dev/null 2>&1)
    code=$?
    case " $codes " in
        *" $code "*) ! printf '%s' "$answer" | tr -s '\n ' ' ' | grep -q "$pattern" || return 0 ;;
    esac
    lost=$((lost + 1))
    printf 'NOT OPENED (exit code %s): ocmm %s\n%s\n' "$code" "$*" "$answer"
}
# same_tables STATION FOLDER: points, features and results as the older version printed them.
same_tables() {
    # Other files name the program that wrote them.
    for table in "$root/home/tester/stations/old/$1/again"/*_points.csv \
        "$root/home/tester/stations/old/$1/again"/*_features.csv \
        "$root/home/tester/stations/old/$1/again"/*_report.csv \
        "$root/home/tester/stations/old/$1/again"/*.asc "$root/home/tester/stations/old/$1/again"/*.pwmacro; do
        opened=$((opened + 1))
        cmp "$table" "$root/home/tester/stations/old/$1/$2/${table##*/}" || lost=$((lost + 1))
    done
}
opens_everything() {
    opened=0 lost=0
    for job in BALL-001 DEMO-001; do
        opens station "0 1" . report "jobs/$job.ocmm" --format polyworks --out again
    done
    same_tables station jobs
    opens station 0 'are as they were written' audit verify jobs
    opens station "0 1" 'Ball diameter' measure --continue open/BALL-001.ocmm --archive off
    opens station 0 'Q. Engineer' plan check ball.toml
    opens station 2 '800 delivered, 0 lost' measure --plan ball.toml --source replay:frames.rec --archive off --out replayed
    opens station 0 . acceptance recompute "acceptance/records/$(ls "$root/home/tester/stations/old/station/acceptance/records")"
    opens station 0 PASS acceptance status --folder acceptance
    opens station 0 'Checked 1, wrong 0' archive verify --archive archive.sqlite
    opens station 0 . settings check
    opens station 0 'ethercat:service' settings show --json
    opens station "0 1" 20 msa status study.toml jobs
    set -- --rig rig.toml --calibrations cameras
    opens calibration 0 'State VALID.*whole: history of 2 events, 2 records, 2 sessions' calibrate status "$@"
    opens calibration 0 'verification passed' calibrate history "$@"
    opens calibration 0 'State VALID.*whole: history of 3 events, 3 records, 3 sessions' calibrate probe-status --probes probes
    set -- "$@" --temperature 20 --temperature-u 0.5 --who Q --accept
    opens calibration 0 'Continue.*State VALID.*3 sessions' calibrate verify "$@"
    opens calibration 0 'Continue.*6 mm: VALID' calibrate check-tip --probes probes --tip "6 mm" "$@"
    # Files of the newer version next to them, for the way back.
    opens station "0 1" 'Ball diameter' measure --plan ball.toml --out new --archive archive.sqlite
    opens station 0 . settings set window.theme dark
    echo "SAID: $((opened - lost)) of $opened"
    [ "$lost" = 0 ]
}
# The older version on files of the newer one: an answer or a refusal, no internal error.
older_answers() {
    opened=0 lost=0
    opens station "0 1 2" . report new/BALL-001.ocmm --format polyworks --out by-older
    opens station "0 1 2" . report jobs/DEMO-001.ocmm --format polyworks --out by-older
    opens station "0 1 2" . archive verify --archive archive.sqlite
    opens station "0 1 2" . settings show
    opens calibration "0 1 2" . calibrate status --rig rig.toml --calibrations cameras
    [ "$lost" = 0 ]
}

# Kill dpkg at a moment of the upgrade, then mend.
one_kill() {
    inside dpkg -r ocmm >/dev/null 2>&1
    inside dpkg -i /old.deb >/dev/null 2>&1 || return 1
    inside setsid dpkg -i /newer.deb >/dev/null 2>&1 &
    started=$!
    sleep "$1"
    end KILL 'dpkg -i /newer.deb|dpkg-deb .*newer.deb|ocmm.postinst|ocmm.preinst'
    wait "$started" 2>/dev/null
    before=$(inside dpkg-query -W -f='${Status}' ocmm)
    # Whole as it is: the old version or the new one.
    works=$(inside ocmm --version 2>&1)
    inside dpkg --configure -a
    how="dpkg --configure -a"
    # Where it was killed while it unpacked, dpkg wants the package again.
    if [ "$(inside dpkg-query -W -f='${Status}' ocmm)" != "install ok installed" ]; then
        inside dpkg -i /newer.deb >/dev/null 2>&1
        how="dpkg -i"
    fi
    said=$(inside ocmm --version)
    echo "killed after $1 s: $before; $works; mended by $how: $said"
    case $works in "ocmm "*) ;; *) return 1 ;; esac
    [ "$(inside dpkg-query -W -f='${Status}' ocmm)" = "install ok installed" ] && rights &&
        case $said in "ocmm "*) ;; *) false ;; esac
}
kills() {
    begun=$(date +%s%N)
    inside dpkg -i /newer.deb >/dev/null 2>&1
    took=$((($(date +%s%N) - begun) / 1000000))
    echo "an upgrade takes $took ms"
    mended=0
    for moment in $(seq 1 "$kills"); do
        after=$((took * moment / (kills + 1)))
        one_kill "$((after / 1000)).$(printf %03d $((after % 1000)))" && mended=$((mended + 1))
    done
    echo "mended: $mended of $kills"
    [ "$mended" -eq "$kills" ]
}

# The wheel, as README says, in an empty environment of this computer's Python.
wheel_measures() {
    wheel=$(ls "${deb%/*}/ocmm-$version"*-py3-none-any.whl) || return 77
    python=${PYTHON:-python3}
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || return 77
    rm -rf "$work/wheel"
    "$python" -m venv "$work/wheel" || return 1
    (cd "$work/wheel" && bin/pip -q install "$wheel[station]" &&
        env -i HOME="$work/wheel" PATH=/usr/bin:/bin LANG=C.UTF-8 sh -c \
            "bin/ocmm compile; bin/ocmm demo --headless --out first; [ \$? -le 1 ] && exec bin/ocmm report \
            first/DEMO-001.ocmm --format json --out numbers")
    [ $? -le 1 ] || return 1
    clone_measures || return 0
    like_the_clone "$work/wheel"
}
same_bytes_twice() {
    for one in one two/longer; do
        rm -rf "${work:?}/twice/$one"
        "$here/build.sh" --out "$work/twice/$one/out" --work "$work/twice/$one/work" || return 1
        rm -rf "$work/twice/$one/work"
    done
    cat "$work/twice/one/out/SHA256SUMS"
    cmp "$work/twice/one/out/SHA256SUMS" "$work/twice/two/longer/out/SHA256SUMS"
}
[ -z "$twice" ] || verdict same-bytes-of-two-builds same_bytes_twice
[ -n "$quick" ] || verdict wheel wheel_measures

for suite in $suites; do
    root=$work/root-$suite
    trap close_root EXIT
    trap 'exit 130' INT TERM
    if ! open_root; then
        printf 'NOT RUN  %s: no root could be made (%s)\n' "$suite" "$work/seen/$suite-root.txt"
        continue
    fi
    for round in $(seq 1 "$rounds"); do
        # Where it is not there, all else would fail for the same reason.
        verdict "$round-install" install_it /old.deb || break
        verdict "$round-rights" rights
        verdict "$round-key" key_is_there
        rm -rf "$root/home/tester/wire"
        if [ "$round" = 1 ]; then
            verdict demo measures first
            [ -n "$from" ] || verdict same-numbers-as-the-clone same_numbers_as_the_clone
            verdict files-of-each-kind writes_files
        fi
        [ -n "$quick" ] || verdict "$round-measures" measures_again
        [ -n "$quick" ] || verdict "$round-wire" measures_on_the_wire
        if [ "$round" = 1 ] && [ -z "$quick" ]; then
            verdict nothing-compiles nothing_compiles
            verdict pages pages
            verdict bus-rights bus_has_its_rights
            verdict window window "" ""
            verdict window-of-a-job window 'first/*.ocmm' -job
            [ "$starts" = 0 ] || verdict starts-by-the-icon starts_in_time --start
            [ "$starts" = 0 ] || verdict starts-to-measure starts_in_time ""
            verdict tar tar_runs
        fi
        keep_sums
        verdict "$round-upgrade" upgrade
        verdict "$round-rights-after-upgrade" rights
        verdict "$round-same-bytes-after-upgrade" same_bytes
        verdict "$round-old-job" reads_the_old_job
        [ "$round" != 1 ] || verdict opens-everything opens_everything
        keep_sums
        verdict "$round-downgrade-refused" refuses_downgrade
        [ "$round" != 1 ] || [ -n "$quick" ] || [ "$kills" = 0 ] || verdict kills kills
        verdict "$round-remove" remove
        verdict "$round-same-bytes" same_bytes
        verdict "$round-purge" purge
        verdict "$round-same-bytes-after-purge" same_bytes
    done
    verdict install-again install_it /old.deb
    verdict same-bytes-at-the-end same_bytes
    close_root
    rm -rf --one-file-system "$root"
    trap - EXIT
done
exit "$failed"
