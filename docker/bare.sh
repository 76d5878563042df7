#!/bin/bash
# Runs make targets of a fresh clone in a bare Debian, to prove that nothing but the prerequisites is needed.
#
# Usage (as root; needs debootstrap and git): docker/bare.sh [OPTION...] [TARGET...]
#   TARGET           make targets, run in this order                            (default: demo test)
#   --as WHO         root, user or both                                         (default: both)
#   --suite NAME     Debian release                                             (default: bookworm)
#   --mirror URL     where debootstrap fetches from                             (default: what apt uses here)
#   --packages LIST  what is installed beforehand                               (default: "git make python3")
#   --folder DIR     holds the bare system, kept for the next time              (default: /var/tmp/paramove-bare)
#   --keep           leaves the used copy standing to look at
#
# As an ordinary user the set-up may lack Debian packages. It must then print the one command for an administrator; this
# script runs exactly that command as root and goes on. pip's and the network's configuration of this machine (PIP_*,
# *_proxy, *CERT* variables with the files they name, pip.conf, resolv.conf, hosts) is passed in as it is.
set -euo pipefail

who=both suite=bookworm mirror="" packages="git make python3" folder=/var/tmp/paramove-bare keep=""
targets=()
while (($#)); do
    case $1 in
        --as) who=$2; shift 2 ;;
        --suite) suite=$2; shift 2 ;;
        --mirror) mirror=$2; shift 2 ;;
        --packages) packages=$2; shift 2 ;;
        --folder) folder=$2; shift 2 ;;
        --keep) keep=yes; shift ;;
        -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//;p}' "$0"; exit 0 ;;
        -*) echo "bare.sh: unknown option $1 (see --help)" >&2; exit 2 ;;
        *) targets+=("$1"); shift ;;
    esac
done
((${#targets[@]})) || targets=(demo test)
case $who in root | user) people=("$who") ;; both) people=(root user) ;; *) echo "bare.sh: --as root|user|both" >&2; exit 2 ;; esac
[ "$(id -u)" = 0 ] || { echo "bare.sh: run it as root" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "bare.sh: as root run: apt-get install -y debootstrap" >&2; exit 1; }
repository=$(cd "$(dirname "$0")/.." && pwd)
base=$folder/$suite

default_mirror() { # the first address that apt uses here
    cat /etc/apt/sources.list /etc/apt/sources.list.d/*.sources /etc/apt/sources.list.d/*.list 2>/dev/null |
        sed -nE 's/^(URIs:|deb( \[[^]]*\])?) *([^ ]+).*/\3/p' | head -n 1
}

pass_in() { # configuration files of this machine into the system at $1, at the same places
    local root=$1 file
    for file in /etc/resolv.conf /etc/hosts /etc/pip.conf; do
        [ -e "$file" ] && cp -L "$file" "$root$file"
    done
    for file in "$HOME/.config/pip/pip.conf" "$HOME/.pip/pip.conf"; do
        [ -e "$file" ] && cp -L "$file" "$root/etc/pip.conf"
    done
    mkdir -p "$root/opt/host"
    while IFS== read -r name file; do
        [ -e "$file" ] && cp -rLT "$file" "$root/opt/host/$name"
    done < <(host_variables)
    for file in /etc/apt/apt.conf.d/*proxy*; do
        [ -e "$file" ] && cp "$file" "$root$file"
    done
    return 0
}

host_variables() { # of pip and of the network; pip.conf's certificates as a variable
    env | grep -E '^(PIP_[A-Z_]*|(https?|no|HTTPS?|NO)_(proxy|PROXY)|SSL_CERT_FILE)=' || true
    local cert
    cert=$(python3 -m pip config get global.cert 2>/dev/null || true)
    [ -n "${PIP_CERT:-$cert}" ] && echo "PIP_CERT=${PIP_CERT:-$cert}"
    return 0
}

passed_variables() { # the same, with files at the place where pass_in puts them: packages may overwrite the old one
    local name value
    while IFS== read -r name value; do
        if [ -e "$value" ]; then echo "$name=/opt/host/$name"; else echo "$name=$value"; fi
    done < <(host_variables)
}

work=""
clean_up() {
    [ -n "$work" ] || return 0
    for place in proc dev/pts dev/shm; do
        ! mountpoint -q "$work/$place" || umount "$work/$place" || umount --lazy "$work/$place"
    done
    if [ -n "$keep" ]; then echo "bare.sh: left standing: $work"; else rm -rf --one-file-system "$work"; fi
    work=""
}
trap clean_up EXIT

if [ ! -e "$base/etc/debian_version" ]; then
    echo "bare.sh: makes a bare Debian $suite in $base"
    mkdir -p "$folder"
    rm -rf "$base.part"
    debootstrap --variant=minbase "$suite" "$base.part" "${mirror:-$(default_mirror)}" >"$folder/debootstrap.log" ||
        { tail -n 5 "$folder/debootstrap.log" >&2; exit 1; }
    mv "$base.part" "$base"
fi

inside() { # command $2... as $1 in the bare system, with a clean environment
    local user=$1 home=/home/tester
    shift
    [ "$user" = root ] && home=/root
    mapfile -t variables < <(passed_variables)
    chroot --userspec="$user:$user" "$work" env -i HOME=$home PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin \
        LANG=C.UTF-8 "${variables[@]}" "$@"
}

make_target() { # as $1, target $2; obeys the command printed for an administrator once
    local user=$1 target=$2 home=/home/tester output=$work/tmp/output command
    [ "$user" = root ] && home=/root
    : >"$output"
    if inside "$user" make -C "$home/paramove" "$target" 2>&1 | tee "$output"; then
        return 0
    fi
    command=$(sed -n '/As root run/{n;s/^    //p}' "$output")
    [ "$user" != root ] && [ -n "$command" ] || return 1
    echo "bare.sh: runs as root, as printed: $command"
    inside root sh -c "DEBIAN_FRONTEND=noninteractive; export DEBIAN_FRONTEND; $command" >"$work/tmp/apt.log" 2>&1 ||
        { tail -n 5 "$work/tmp/apt.log" >&2; return 1; }
    inside "$user" make -C "$home/paramove" "$target"
}

for person in "${people[@]}"; do
    work=$(mktemp -d "$folder/$suite-$person.XXXXXX")
    cp -a --reflink=auto "$base/." "$work/"
    chmod 755 "$work"
    pass_in "$work"
    mount -t proc proc "$work/proc"
    mount -t devpts -o newinstance,ptmxmode=0666,mode=0620 devpts "$work/dev/pts"
    ln -sf pts/ptmx "$work/dev/ptmx"
    mount -t tmpfs -o mode=1777 tmpfs "$work/dev/shm"
    echo "bare.sh: installs the prerequisites: $packages"
    { inside root apt-get update && inside root apt-get install -y --no-install-recommends $packages; } \
        >"$work/tmp/prerequisites.log" 2>&1 || { tail -n 5 "$work/tmp/prerequisites.log" >&2; exit 1; }
    user=root home=/root
    if [ "$person" = user ]; then
        user=tester home=/home/tester
        inside root useradd --create-home --shell /bin/bash tester
    fi
    git clone --quiet --no-hardlinks "$repository" "$work$home/paramove"
    inside root chown -R "$user:$user" "$home/paramove"
    for target in "${targets[@]}"; do
        echo "bare.sh: make $target as $person"
        begun=$SECONDS
        make_target "$user" "$target" || { echo "bare.sh: make $target as $person FAILED" >&2; exit 1; }
        echo "bare.sh: make $target as $person worked, $((SECONDS - begun)) s"
    done
    clean_up
done
