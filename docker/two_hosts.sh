#!/bin/sh
# One of two containers that are two computers of a run: `camera` waits for ssh, `robot` trusts it and launches.
#
# Usage: docker/two_hosts.sh camera | docker/two_hosts.sh robot [ARGUMENT of `paramove launch` ...]
# Both share the folder ~/keys, in which the camera's container puts the keys of ssh, made anew at each start.
set -eu
keys=$HOME/keys
cd "$(dirname "$0")/.."

case ${1:-} in
    camera)
        rm -f "$keys"/*
        ssh-keygen -q -t ed25519 -N "" -f "$keys/host"
        ssh-keygen -q -t ed25519 -N "" -f "$keys/person"
        cp "$keys/person.pub" "$keys/authorized"
        exec /usr/sbin/sshd -D -e -p 2222 -h "$keys/host" -o PidFile=none -o UsePAM=no -o StrictModes=no \
            -o PasswordAuthentication=no -o AuthorizedKeysFile="$keys/authorized"
        ;;
    robot)
        shift
        mkdir -p -m 700 "$HOME/.ssh"
        printf 'Host camera-pc\n HostName %s\n HostKeyAlias camera-pc\n Port 2222\n IdentityFile %s\n' \
            "${CAMERA_ADDRESS:-camera}" "$keys/person" >"$HOME/.ssh/config"
        there="--folder $PWD --command $PWD/.venv/bin/paramove"
        # shellcheck disable=SC2086
        until { echo "camera-pc $(cut -d " " -f 1,2 "$keys/host.pub")" >"$HOME/.ssh/known_hosts"; } 2>/dev/null &&
            .venv/bin/paramove host trust camera-pc $there; do sleep 1; done
        echo "hosts: {camera_pc: {folder: $PWD, command: $PWD/.venv/bin/paramove}}" >"$HOME/folder.yaml"
        exec .venv/bin/paramove launch "$@" --with two_hosts --with "$HOME/folder.yaml"
        ;;
    *)
        sed -n '2,5s/^# \{0,1\}//p' "$0" >&2
        exit 2
        ;;
esac
