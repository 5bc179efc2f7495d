#!/bin/sh
# gpu_bundle.sh BUILD_FOLDER FILE.tar.xz [WHEEL...]: packs all that gpu_all.sh needs on a machine with NVIDIA's driver, NVRTC
# and python3, without this project's dependencies (docs/gpu.md). With wheels, of relign-bench for that machine's version of
# Python and of pure Python packages that it lacks, also what needs the Python package.
set -eu
[ $# -ge 2 ] || { echo "usage: gpu_bundle.sh BUILD_FOLDER FILE.tar.xz [WHEEL...]" >&2; exit 2; }
build=$1
file=$2
shift 2
here=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
out=$work/relign-bench-gpu
mkdir -p "$out/lib" "$out/plugins" "$out/python" "$out/tests/python"
cp "$build/benchmarks/relign-bench-gpu" "$out/"
for plugin in lens_system rho; do cp -R "$build/lib/relign-bench/plugins/$plugin" "$out/plugins/"; done
strip --strip-unneeded "$out/relign-bench-gpu" "$out"/plugins/*/*.so
# The C library stays that of the machine with the GPU.
ldd "$out/relign-bench-gpu" "$out"/plugins/*/*.so | awk '$3 ~ /^\// {print $3}' | sort -u |
  grep -Ev '/(libc|libm|libdl|librt|libpthread)\.so' | xargs -I{} cp -L {} "$out/lib/"
cp "$here/python/relign_bench/training/randomisation.json" "$out/"
# As in the source tree, so that the same programs run here and there.
(cd "$here" && tar cf - benchmarks/gpu_* python/recipes) | tar xf - -C "$out"
for name in support test_cuda test_cuda_training test_graphs; do cp "$here/tests/python/$name.py" "$out/tests/python/"; done
changes=$(git -C "$here" status --porcelain --untracked-files=no 2> /dev/null | head -1)
echo "$(git -C "$here" rev-parse HEAD 2> /dev/null || echo unknown)${changes:+ with changes}" > "$out/commit"
for wheel; do python3 -m zipfile -e "$wheel" "$out/python"; done
package=$out/python/relign_bench
if [ -d "$package" ]; then
  # Only the plugins of the environment and the libraries that they and the module need: a third of the wheel.
  rm -rf "$package/bin"
  find "$package/lib/relign-bench/plugins" -mindepth 1 -maxdepth 1 ! -name lens_system ! -name rho ! -name tolerances -exec rm -r {} +
  needed=$(find "$package" -name '*.so' -exec ldd {} + | awk '$3 ~ /relign_bench\.libs/ {print $3}' | xargs -n 1 basename | sort -u)
  for library in "$out"/python/relign_bench.libs/*; do
    echo "$needed" | grep -qx "$(basename "$library")" || rm "$library"
  done
fi
# Most libraries are there twice, with and without Python: a large dictionary keeps one.
tar -C "$work" -cf - relign-bench-gpu | xz -T1 --lzma2=preset=9,dict=128MiB > "$file"
ls -l "$file"
