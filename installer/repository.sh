#!/bin/sh
# Make a signed apt repository of packages, to copy to a web server, a share or a stick:
#
#   installer/repository.sh --key KEY --out DIR PACKAGE.deb...
#
#   --key KEY   fingerprint or address of the secret key in GnuPG that signs; the key of a release,
#               never the key of a station
#   --out DIR   the repository. Packages that are there already stay, so that an upgrade can be taken
#               back; the lists are made anew, and replaced only when all of them are whole
#
# Stations take the public key once, DIR/ocmm.gpg, by a way that they trust, and then install and
# upgrade by apt, which refuses what this key has not signed:
#
#   cp ocmm.gpg /usr/share/keyrings/ocmm.gpg
#   echo 'deb [signed-by=/usr/share/keyrings/ocmm.gpg] https://SERVER/PATH stable main' \
#       >/etc/apt/sources.list.d/ocmm.list
#   apt-get update && apt-get install ocmm
#
# It needs dpkg-scanpackages (package dpkg-dev) and gpg, and no root.
set -eu
umask 022
export LC_ALL=C

say() { printf 'repository: %s\n' "$*" >&2; }
fail() { say "$@"; exit 2; }

key='' out=''
while [ $# -gt 0 ]; do
    case $1 in
        -h | --help) sed -n '2,/^set -eu/{/^set -eu/d;s/^# \{0,1\}//;p;}' "$0"; exit 0 ;;
        --key | --out) [ $# -ge 2 ] || fail "$1 needs a value." ;;
        -*) fail "There is no '$1'. See $0 --help" ;;
        *) break ;;
    esac
    case $1 in
        --key) key=$2 ;;
        --out) out=$2 ;;
    esac
    shift 2
done
[ -n "$key" ] || fail "Name the key that signs: --key"
[ -n "$out" ] || fail "Name the folder of the repository: --out"
[ $# -gt 0 ] || [ -d "$out/pool" ] || fail "Name at least one package."
for tool in dpkg-deb dpkg-scanpackages gpg sha256sum gzip; do
    command -v "$tool" >/dev/null || fail "The program '$tool' is missing."
done
gpg --batch --list-secret-keys "$key" >/dev/null 2>&1 || fail "GnuPG has no secret key '$key'."
for package; do
    [ "$(dpkg-deb -f "$package" Package 2>/dev/null)" = ocmm ] || fail "'$package' is no package of OCMM."
done

pool=$out/pool/main/o/ocmm
mkdir -p "$pool"
for package; do
    name=ocmm_$(dpkg-deb -f "$package" Version)_$(dpkg-deb -f "$package" Architecture).deb
    # Stations may have it: a version is never two different packages.
    if [ -e "$pool/$name" ]; then
        cmp -s "$package" "$pool/$name" || fail "Another $name is in the repository. Raise the version."
        continue
    fi
    cp "$package" "$pool/.$name"
    mv "$pool/.$name" "$pool/$name"
done

new=$out/.dists
rm -rf "$new"
trap 'rm -rf "$new"' EXIT
cd "$out"
architectures=$(for one in pool/main/o/ocmm/*.deb; do dpkg-deb -f "$one" Architecture; done | sort -u)
for architecture in $architectures; do
    list=.dists/stable/main/binary-$architecture
    mkdir -p "$list"
    # -m: all versions, not only the newest.
    dpkg-scanpackages -m -a "$architecture" pool >"$list/Packages" 2>"$list/errors" || fail "$(cat "$list/errors")"
    rm "$list/errors"
    gzip -9nk "$list/Packages"
done
(
    cd .dists/stable
    printf 'Origin: OCMM\nLabel: OCMM\nSuite: stable\nCodename: stable\nComponents: main\n'
    printf 'Architectures: %s\n' "$(printf '%s' "$architectures" | tr '\n' ' ')"
    printf 'Date: %s\nSHA256:\n' "$(date -u '+%a, %d %b %Y %H:%M:%S UTC')"
    find main -type f | sort | while read -r file; do
        printf ' %s %s %s\n' "$(sha256sum <"$file" | cut -d' ' -f1)" "$(wc -c <"$file")" "$file"
    done
) >.dists/Release
mv .dists/Release .dists/stable/
gpg --batch --yes --local-user "$key" --clearsign --output .dists/stable/InRelease .dists/stable/Release
gpg --batch --yes --local-user "$key" --armor --detach-sign --output .dists/stable/Release.gpg .dists/stable/Release
gpg --batch --yes --export --output .ocmm.gpg "$key"
mv .ocmm.gpg ocmm.gpg
rm -rf dists
mv .dists dists
say "$(find pool -name '*.deb' | wc -l) packages, signed by $key, in $PWD"
