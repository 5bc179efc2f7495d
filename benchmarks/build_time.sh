#!/bin/bash
# Time of a build without a compiler cache: benchmarks/build_time.sh [FOLDER]
#
# Builds what `./quickstart run` builds, then what `./quickstart test` adds, then once more after a change in one source
# file, into FOLDER [default: a new one in /tmp, removed afterwards]. Prints wall time, processor time and steps of each.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-}
if [ -z "$folder" ]; then
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
fi
export CCACHE_DISABLE=1
touched=core/analysis/report/verdict.cpp

measure() {  # NAME TARGET...
  TIMEFORMAT="$1: %R s wall, %U + %S s processor"
  time ninja -C "$folder" "${@:2}" >"$folder/build.log" || {
    tail -20 "$folder/build.log" >&2
    exit 1
  }
  echo "  $(grep -oE '^\[[0-9]+/[0-9]+\]' "$folder/build.log" | tail -1) steps"
}

cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DRELIGN_BUILD_TESTS=OFF -DRELIGN_BUILD_BENCHMARKS=OFF \
  -DRELIGN_BUILD_PYTHON=OFF >/dev/null
measure "run" relign-bench relign_plugins
cmake "$folder" -DRELIGN_BUILD_TESTS=ON -DRELIGN_BUILD_BENCHMARKS=ON -DRELIGN_BUILD_PYTHON=ON >/dev/null
measure "test, on top of run" all
touch $touched
measure "after a change in $touched" relign-bench test_analysis_report
echo "objects: $(find "$folder" -name '*.o' | wc -l)"
