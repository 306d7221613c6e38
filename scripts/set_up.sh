#!/bin/sh
# Make everything ready for `make demo`, `make test` or `make bench-peers`; quick when that has been done before.
#
#     sh scripts/set_up.sh demo|edit|test|peers
#
# As root on Debian or Ubuntu, installs the system packages that are missing. Otherwise says which they are and
# goes on with what is there: without OpenGL the demo runs on the OpenCL driver that comes as a wheel.
# Environment: VENV (.venv), PYTHON (a Python of 3.11 or newer; default: the first that is found).
set -eu
cd "$(dirname "$0")/.."

goal=${1:-demo}
venv=${VENV:-.venv}
case $goal in
    demo) extras="" ;;
    edit) extras="[editor]" ;;
    test) extras="[test,dev,plot,dask,accuracy,editor]" ;;
    peers) extras="[test,dev,plot,dask,peers,editor]" ;;
    *) echo "set_up.sh: '$goal' is none of demo, edit, test and peers" >&2; exit 2 ;;
esac

say() { echo "set-up: $*" >&2; }

# --- system packages -------------------------------------------------------------------------------------------
# OpenGL without a display (Mesa's llvmpipe), OpenCL on the CPU (PoCL), and the linker that PoCL calls.
packages="libegl1 libgl1 libgl1-mesa-dri pocl-opencl-icd binutils"
# Qt: its offscreen platform, which the tests use, and X11 for a window on the screen.
qt="libxkbcommon0 libdbus-1-3 libfontconfig1 libglib2.0-0 fonts-dejavu-core"
x11="libxcb-cursor0 libxcb-icccm4 libxcb-image0 libxcb-keysyms1 libxcb-render-util0 libxcb-shape0 libxcb-xkb1 libxkbcommon-x11-0"
case $goal in
    edit) packages="$packages $qt $x11" ;;
    test | peers) packages="$packages $qt" ;;
esac

missing() {
    for package in "$@"; do
        dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || printf '%s ' "$package"
    done
}

install() {
    say "installing $*"
    log=$(mktemp)
    if { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@"; } >"$log" 2>&1; then
        rm -f "$log"
    else
        tail -n 3 "$log" >&2
        rm -f "$log"
        say "apt-get could not install $*"
        return 1
    fi
}

has_apt() { command -v apt-get >/dev/null 2>&1 && command -v dpkg-query >/dev/null 2>&1; }
is_root() { [ "$(id -u)" -eq 0 ]; }

if has_apt; then
    wanted=$(missing $packages)
    # shellcheck disable=SC2086  # a list of words
    if [ -z "$wanted" ]; then
        :
    elif is_root; then
        install $wanted || say "going on with what is there"
    else
        say "not root, so going on with what is there; for all devices: sudo apt-get install ${wanted% }"
    fi
fi

# --- Python ----------------------------------------------------------------------------------------------------
is_new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

find_python() {
    if [ -n "${PYTHON:-}" ]; then
        if is_new_enough "$PYTHON"; then
            command -v "$PYTHON"
            return
        fi
        say "PYTHON=$PYTHON is no Python of 3.11 or newer: name one that is, or none"
        return 1
    fi
    for candidate in python3 python3.14 python3.13 python3.12 python3.11 python; do
        if is_new_enough "$candidate"; then
            command -v "$candidate"
            return
        fi
    done
    say "no Python of 3.11 or newer was found: install one, or name it: make $goal PYTHON=/path/to/python3"
    return 1
}

# Where an environment lies and which Python it stands on. One that was moved, whose Python went away, or whose making
# was interrupted is made anew, and so is one that stands on another Python than PYTHON names.
identity='import os, sys; print(os.path.realpath(sys.argv[1]), sys.base_prefix, *sys.version_info[:2])'
identify() { "$1" -c "$identity" "$venv" 2>/dev/null; }
is_sound() {
    is_new_enough "$venv/bin/python" && "$venv/bin/python" -c 'import pip' 2>/dev/null || return 1
    now=$(identify "$venv/bin/python")
    [ "$now" = "$(cat "$venv/.made-of" 2>/dev/null || echo "$now")" ] || return 1
    [ -z "${PYTHON:-}" ] || [ "$now" = "$(identify "$PYTHON")" ]
}

if ! is_sound; then
    if [ -e "$venv" ] && [ ! -e "$venv/pyvenv.cfg" ] && [ -n "$(ls -A "$venv")" ]; then
        say "VENV=$venv is there and no virtual environment: name another folder, or remove it"
        exit 1
    fi
    python=$(find_python)
    if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        package=$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
        if ! has_apt || ! is_root || ! install "$package"; then
            say "$python cannot make virtual environments: install $package"
            exit 1
        fi
    fi
    say "making $venv with $("$python" --version)"
    "$python" -m venv --clear "$venv"
fi
echo '*' >"$venv/.gitignore"
identify "$venv/bin/python" >"$venv/.made-of"

# --- Python packages -------------------------------------------------------------------------------------------
# The stamp holds what it was made from. `test` brings all that `demo` and `edit` need.
recipe=$(cat pyproject.toml scripts/set_up.sh | cksum)
is_done() { [ -f "$venv/.ready-$1" ] && [ "$(cat "$venv/.ready-$1")" = "$recipe" ]; }

if ! is_done "$goal" && ! { { [ "$goal" = demo ] || [ "$goal" = edit ]; } && is_done test; }; then
    say "installing Python packages for '$goal' into $venv"
    if ! "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --editable ".$extras"; then
        say "pip could not install the packages, see above; when that is mended (is there a network?), say make $goal again"
        exit 1
    fi
    echo "$recipe" >"$venv/.ready-$goal"
fi
