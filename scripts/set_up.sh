#!/bin/sh
# Make everything ready for `make demo` or `make test`; quick when that has been done before.
#
#     sh scripts/set_up.sh demo|test
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
    test) extras="[test,dev,plot,dask]" ;;
    *) echo "set_up.sh: '$goal' is neither demo nor test" >&2; exit 2 ;;
esac

say() { echo "set-up: $*" >&2; }

# --- system packages -------------------------------------------------------------------------------------------
# OpenGL without a display (Mesa's llvmpipe), OpenCL on the CPU (PoCL), and the linker that PoCL calls.
packages="libegl1 libgl1 libgl1-mesa-dri pocl-opencl-icd binutils"

missing() {
    for package in "$@"; do
        dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || printf '%s ' "$package"
    done
}

install() {  # the packages named, or a sentence that says what to install
    if [ "$(id -u)" -ne 0 ]; then
        say "not root, so nothing is installed; for all devices: sudo apt-get install $*"
        return 1
    fi
    say "installing $*"
    log=$(mktemp)
    if { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@"; } >"$log" 2>&1; then
        rm -f "$log"
    else
        tail -n 3 "$log" >&2
        rm -f "$log"
        say "apt-get could not install $*: going on with what is there"
        return 1
    fi
}

has_apt() { command -v apt-get >/dev/null 2>&1 && command -v dpkg-query >/dev/null 2>&1; }

if has_apt; then
    wanted=$(missing $packages)
    # shellcheck disable=SC2086  # a list of words
    [ -z "$wanted" ] || install $wanted || true
fi

# --- Python ----------------------------------------------------------------------------------------------------
is_new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

find_python() {
    for candidate in ${PYTHON:-} python3 python3.13 python3.12 python3.11 python; do
        if command -v "$candidate" >/dev/null 2>&1 && is_new_enough "$candidate"; then
            command -v "$candidate"
            return
        fi
    done
    say "no Python of 3.11 or newer was found: install one, or name it: make $goal PYTHON=/path/to/python3"
    return 1
}

if ! is_new_enough "$venv/bin/python"; then
    python=$(find_python)
    if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        if ! has_apt || ! install "python$version-venv"; then
            say "$python cannot make virtual environments: install python$version-venv"
            exit 1
        fi
    fi
    say "making $venv with $("$python" --version)"
    "$python" -m venv --clear "$venv"
fi

# --- Python packages -------------------------------------------------------------------------------------------
# The stamp holds what it was made from. `test` brings all that `demo` needs.
recipe=$(cat pyproject.toml scripts/set_up.sh | cksum)
is_done() { [ -f "$venv/.ready-$1" ] && [ "$(cat "$venv/.ready-$1")" = "$recipe" ]; }

if ! is_done "$goal" && ! { [ "$goal" = demo ] && is_done test; }; then
    say "installing Python packages for '$goal' into $venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --editable ".$extras"
    echo "$recipe" >"$venv/.ready-$goal"
fi
