#!/bin/sh
# Everything that is to be measured on a GPU, in order of its worth, as far as the time suffices: gpu_all.sh --help.
exec "${PYTHON:-python3}" "$(dirname "$0")/gpu_all.py" "$@"
