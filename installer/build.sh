#!/bin/sh
# Build what is handed out, from the last commit of this folder:
#
#   installer/build.sh [--out DIR] [--work DIR] [--version VERSION]
#
#   ocmm_VERSION_amd64.deb              for Debian 12 and 13, Ubuntu 24.04 and 26.04 (installer/test.sh)
#   ocmm-VERSION-linux-amd64.tar.xz     the same programs for other distributions
#   ocmm-VERSION+COMMIT-py3-none-any.whl   for a Python that is there already
#   SHA256SUMS
#
#   --out DIR          where they go; default: dist of this folder
#   --work DIR         where is built; default: a new folder under TMPDIR, removed at the end. In one
#                      that is there already, the tools and kernels that fit are used again
#   --version VERSION  of the packages, to try an upgrade with; default: what the sources say
#
# It needs no root and nothing but Python 3.11 or newer with its shared library, git, dpkg, binutils
# and xz; what else builds is installed by requirements-package.lock, by hash, into the
# folder of the build. The date is the commit's, order and modes are fixed: the same commit, Python
# and system libraries give the same bytes. PYTHON=/path/to/python3.11 picks the Python.
set -eu
umask 022
LC_ALL=C.UTF-8 TZ=UTC PYTHONHASHSEED=0
export LC_ALL TZ PYTHONHASHSEED
unset PYTHONPATH PYTHONDONTWRITEBYTECODE

begun=$(date +%s)
say() { printf 'build: %4d s  %s\n' "$(($(date +%s) - begun))" "$*" >&2; }
fail() { say "$@"; exit 2; }

root=$(cd -- "$(dirname -- "$0")/.." && pwd -P)
out=$root/dist
work=
version=
while [ $# -gt 0 ]; do
    case $1 in
        -h | --help) sed -n '2,/^set -eu/{/^set -eu/d;s/^# \{0,1\}//;p;}' "$0"; exit 0 ;;
        --out | --work | --version) [ $# -ge 2 ] || fail "$1 needs a value." ;;
        *) fail "There is no '$1'. See $0 --help" ;;
    esac
    case $1 in
        --out)     out=$2 ;;
        --work)    work=$2 ;;
        --version) version=$2 ;;
    esac
    shift 2
done
for tool in git dpkg-deb as ld nm objcopy strip xz tar; do
    command -v "$tool" >/dev/null || fail "The program '$tool' is missing."
done
mkdir -p "$out"
out=$(cd -- "$out" && pwd -P)
if [ -z "$work" ]; then
    work=$(mktemp -d)
    trap 'rm -rf -- "$work"' EXIT
    trap 'exit 130' INT TERM
fi
mkdir -p "$work"
work=$(cd -- "$work" && pwd -P)

# 1. The sources, as they were committed.
SOURCE_DATE_EPOCH=$(git -C "$root" log -1 --format=%ct)
export SOURCE_DATE_EPOCH
[ -z "$(git -C "$root" status --porcelain)" ] ||
    say "This folder holds changes that are not committed; they are not in the packages."
src=$work/src
rm -rf -- "$src" "$work/bundle" "$work/deb" "$work/tar"
mkdir -p "$src"
git -C "$root" archive HEAD | tar -x -C "$src"
cd "$src"
stated=$(sed -n 's/^__version__ = "\(.*\)"/\1/p' ocmm_core/__init__.py)
[ -z "$version" ] || sed -i "s/^__version__ = .*/__version__ = \"$version\"/" ocmm_core/__init__.py
# Debian's version of a build before a release is older than that of the release; one behind it is
# newer, so a repaired package replaces the one before.
behind=$(TZ=UTC git -C "$root" log -1 --date=format-local:%Y%m%d%H%M%S --format=git%cd.%h --abbrev=10)
if [ -n "$version" ] ||
    git -C "$root" describe --tags --exact-match --match "v$stated" >/dev/null 2>&1; then
    deb_version=${version:-$stated}-1
elif git -C "$root" merge-base --is-ancestor "v$stated" HEAD 2>/dev/null; then
    deb_version=$stated-1+$behind
else
    deb_version=$stated-1~$behind
fi
version=${version:-$stated}

# 2. What builds, and what is built in, by hash.
say "Installing what builds."
python=$work/venv/bin/python
if [ ! -x "$python" ]; then
    for base in ${PYTHON:-} python3.11 python3.12 python3.13 python3; do
        "$base" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && break
        base=
    done
    [ -n "$base" ] || fail "Python 3.11 or newer is needed. PYTHON=/path/to/python3.11 names one."
    "$base" -m venv "$work/venv"
fi
# What is frozen is compiled then.
pip="$python -m pip --disable-pip-version-check --quiet install --no-compile"
$pip --require-hashes -r requirements-package.lock

# 3. The wheel; it is also what is frozen.
say "Building the wheel."
rm -rf "$work/wheel"
"$python" -m pip --disable-pip-version-check --quiet wheel --no-deps --no-build-isolation \
    --wheel-dir "$work/wheel" .
wheel=$(ls "$work"/wheel/ocmm-*.whl)
$pip --no-deps --force-reinstall "$wheel"
# What is frozen is what the wheel holds, with its resources.
rm -rf build ./*.egg-info ocmm_*

# 4. The kernels, from a copy of the sources, while the programs are frozen: both take minutes.
kernels=$work/kernels
rm -rf "$work/sources"
mkdir "$work/sources"
cp -r "$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"/ocmm_* installer \
    "$work/sources/"
find "$work/sources" -name __pycache__ -prune -exec rm -rf {} +
# All that a kernel may depend on; the version of OCMM is none of it.
state=$({
    "$python" -VV
    cat requirements-package.lock
    cd "$work/sources" && find ocmm_* installer/bundle -name '*.py' ! -path ocmm_core/__init__.py ! -path ocmm_core/build.py -print0 |
        sort -z | xargs -0 sha256sum
} | sha256sum)
if [ "$(cat "$kernels/state" 2>/dev/null)" = "$state" ]; then
    say "Freezing the programs; the kernels are those of the last build in this folder."
    compiling=
else
    say "Compiling the kernels and freezing the programs, at the same time."
    rm -rf "$kernels"
    mv "$work/sources" "$kernels"
    "$python" installer/bundle/compile_kernels.py "$kernels" & compiling=$!
fi
bundle=$work/bundle/ocmm
if ! "$python" -m PyInstaller --noconfirm --log-level WARN --distpath "$work/bundle" \
    --workpath "$work/pyinstaller" installer/bundle/ocmm.spec; then
    [ -z "$compiling" ] || kill "$compiling" 2>/dev/null || :
    fail "The programs could not be frozen."
fi

# 5. What is not Qt's, nor a library of the GPL or LGPL, which stay as their makers handed them out,
# nor one that was patched after it was linked (numpy, scipy): those cannot be loaded any more.
for library in "$bundle"/_internal/libpython3*.so*; do
    strip --strip-unneeded "$library"
done
for folder in python3.* kernels pkcs11 cryptography; do
    find "$bundle"/_internal/$folder -type f -name '*.so' -exec strip --strip-unneeded {} +
done
# numpy and scipy bring the same run-time library of their compiler: one of them is enough.
for library in "$bundle"/_internal/scipy.libs/*.so*; do
    same=$bundle/_internal/numpy.libs/${library##*/}
    if cmp -s "$library" "$same"; then
        ln -sf "../numpy.libs/${library##*/}" "$library"
    fi
done

say "The programs are frozen."
if [ -n "$compiling" ]; then
    wait "$compiling" || fail "The kernels could not be compiled."
    printf '%s\n' "$state" >"$kernels/state"
fi
cp "$kernels"/kernels/* "$bundle/_internal/kernels/"
# The program with rights is a file of its own, and says by its name what it is; what both load is
# one file.
cp "$bundle/ocmm" "$bundle/ocmm-acq"
ln -s ocmm.pkg "$bundle/ocmm-acq.pkg"

# Libraries are loaded, not run.
find "$bundle" -type f -name '*.so*' -exec chmod a-x {} +

# 6. What goes with them.
say "Writing the pages, licences and the bill of materials."
"$python" -m installer.bundle.pages "$work/pages"
"$python" -m installer.bundle.notices "$bundle" "$bundle/licences"
"$python" -m installer.sbom "$bundle/ocmm.cdx.json"
cp LICENSE THIRD_PARTY_LICENCES.md README.md SECURITY.md "$bundle/"
mkdir -p "$bundle/docs" "$bundle/share"
(cd docs && find . -name '*.md' -exec cp --parents {} "$bundle/docs/" ';')
cp -r "$work/pages/man" "$work/pages/completion" "$bundle/share/"
cp installer/debian/ocmm.desktop installer/debian/ocmm.svg installer/debian/ocmm-mime.xml "$bundle/share/"
# The service runs the program without rights of its own: a file that has some loses those that
# systemd gives.
mkdir -p "$work/units"
cp installer/linux/ocmm-acq.socket "$work/units/"
sed 's#^ExecStart=/opt/ocmm/.venv/bin/python #ExecStart=/opt/ocmm/ocmm #' \
    'installer/linux/ocmm-acq@.service' >"$work/units/ocmm-acq@.service"
cp "$work"/units/* "$bundle/share/"
cp installer/linux/ocmm.sysusers "$bundle/share/"

# No file is more than its owner's to write: ocmm-acq loads what lies here, with its rights.
fixed() {
    chmod -R u=rwX,go=rX "$1"
    find "$1" -exec touch --no-dereference --date="@$SOURCE_DATE_EPOCH" {} +
}

# 7. For other distributions.
say "Packing."
mkdir -p "$work/tar"
cp -a "$bundle" "$work/tar/ocmm-$version"
fixed "$work/tar/ocmm-$version"
tar --sort=name --owner=0 --group=0 --numeric-owner --format=gnu -C "$work/tar" -cf - "ocmm-$version" |
    xz -T2 -0 >"$out/ocmm-$version-linux-amd64.tar.xz" & packing=$!

# 8. For Debian.
deb=$work/deb
place() { mkdir -p "$deb/$2" && cp -a "$1" "$deb/$2/${3:-}"; }
mkdir -p "$deb/opt" "$deb/usr/bin" "$deb/DEBIAN"
cp -a "$bundle" "$deb/opt/ocmm"
rm -rf "$deb/opt/ocmm/share"
ln -s /opt/ocmm/ocmm /opt/ocmm/ocmm-acq "$deb/usr/bin/"
place installer/debian/ocmm.desktop usr/share/applications
place installer/debian/ocmm.metainfo.xml usr/share/metainfo
place installer/debian/ocmm.svg usr/share/icons/hicolor/scalable/apps
place installer/debian/ocmm-mime.xml usr/share/mime/packages ocmm.xml
place "$work/pages/completion/bash/ocmm" usr/share/bash-completion/completions
place "$work/pages/completion/zsh/_ocmm" usr/share/zsh/vendor-completions
place "$work/pages/completion/fish/ocmm.fish" usr/share/fish/vendor_completions.d
place "$work/units/ocmm-acq.socket" usr/lib/systemd/system
place "$work/units/ocmm-acq@.service" usr/lib/systemd/system
place installer/debian/lintian-overrides usr/share/lintian/overrides ocmm
place installer/linux/ocmm.sysusers usr/lib/sysusers.d ocmm.conf
for page in "$work"/pages/man/*.1; do
    mkdir -p "$deb/usr/share/man/man1"
    gzip -9nc "$page" >"$deb/usr/share/man/man1/${page##*/}.gz"
done
mkdir -p "$deb/usr/share/doc/ocmm"
{ cat LICENSE; printf '\nWhat OCMM stands on: /opt/ocmm/THIRD_PARTY_LICENCES.md; the texts: /opt/ocmm/licences\n'; } \
    >"$deb/usr/share/doc/ocmm/copyright"
gzip -9nc CHANGELOG.md >"$deb/usr/share/doc/ocmm/changelog.gz"
{
    printf 'ocmm (%s) unstable; urgency=medium\n\n  * Changes: changelog.gz.\n\n' "$deb_version"
    printf ' -- %s  %s\n' "$(sed -n 's/^Maintainer: //p' installer/debian/control)" \
        "$(date -uR --date="@$SOURCE_DATE_EPOCH")"
} | gzip -9nc >"$deb/usr/share/doc/ocmm/changelog.Debian.gz"
size=$(du -sk --apparent-size "$deb" | cut -f1)
sed "s/@VERSION@/$deb_version/; s/@SIZE@/$size/" installer/debian/control >"$deb/DEBIAN/control"
for script in preinst postinst prerm postrm; do
    cp "installer/debian/$script" "$deb/DEBIAN/"
done
fixed "$deb"
chmod 0755 "$deb"/DEBIAN/p*
(cd "$deb" && find opt usr -type f -print0 | sort -z | xargs -0 md5sum) >"$work/md5sums"
cp "$work/md5sums" "$deb/DEBIAN/md5sums"
fixed "$deb/DEBIAN"
chmod 0755 "$deb"/DEBIAN/p*
dpkg-deb --root-owner-group -Zzstd -z10 --threads-max=2 --build "$deb" \
    "$out/ocmm_${version}_amd64.deb" >&2
cp "$wheel" "$out/"
wait "$packing"

(cd "$out" && sha256sum "ocmm_${version}_amd64.deb" "ocmm-$version-linux-amd64.tar.xz" \
    "${wheel##*/}") >"$out/SHA256SUMS"
cat "$out/SHA256SUMS"
say "Done."
