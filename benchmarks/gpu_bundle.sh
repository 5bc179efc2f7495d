#!/bin/sh
# gpu_bundle.sh BUILD_FOLDER FILE.tgz [WHEEL]: packs relign-bench-gpu, the libraries it needs and a scene, so that it
# runs on another machine with NVIDIA's driver and NVRTC, without this project's dependencies:
#
#   ./quickstart wheel                                            # here
#   benchmarks/gpu_bundle.sh build/release gpu.tgz dist/*.whl     # here
#   tar xzf gpu.tgz && relign-bench-gpu/run          # there: prints the table
set -eu
program=$1/benchmarks/relign-bench-gpu
file=$2
here=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
out=$work/relign-bench-gpu
mkdir -p "$out/lib"
cp "$program" "$out/"
# The C library stays that of the machine with the GPU.
ldd "$program" | awk '$3 ~ /^\// {print $3}' | grep -Ev '/(libc|libm|libdl|librt|libpthread)\.so' |
  xargs -I{} cp -L {} "$out/lib/"
cp -R "$here/plugins/scenes/lens_system/relign_od" "$here/python/relign_bench/training/randomisation.json" "$out/"
# With the self-contained wheel the environment is measured as well, where python3 has its version, torch and gymnasium.
if [ $# -gt 2 ]; then
  cp "$here/benchmarks/gpu_environment.py" "$out/"
  python3 -m zipfile -e "$3" "$out/python"
  # Of the wheel, only the plugins of the environment and the libraries that they and the module need: a quarter of it.
  package=$out/python/relign_bench
  rm -rf "$package/bin" "$package/training"
  find "$package/lib/relign-bench/plugins" -mindepth 1 -maxdepth 1 ! -name lens_system ! -name rho -exec rm -r {} +
  needed=$(find "$package" -name '*.so' -exec ldd {} + | awk '$3 ~ /relign_bench\.libs/ {print $3}' | xargs -n 1 basename | sort -u)
  for library in "$out"/python/relign_bench.libs/*; do
    echo "$needed" | grep -qx "$(basename "$library")" || rm "$library"
  done
fi
cat > "$out/run" <<'RUN'
#!/bin/sh
here=$(cd "$(dirname "$0")" && pwd)
# NVRTC of the Python wheels is on no search path.
if [ -z "${RELIGN_LIBNVRTC:-}" ]; then
  RELIGN_LIBNVRTC=$(python3 -c 'import glob, sys
print("".join([f for p in sys.path for f in glob.glob(p + "/nvidia/*/lib/libnvrtc.so.1[23]")][:1]))' 2> /dev/null)
  [ -n "$RELIGN_LIBNVRTC" ] && export RELIGN_LIBNVRTC || unset RELIGN_LIBNVRTC
fi
# RELIGN_RUN_WITH: a program to run it with, such as compute-sanitizer or ncu.
libraries=${LD_LIBRARY_PATH:-}:/usr/local/nvidia/lib64
LD_LIBRARY_PATH="$here/lib:$libraries" ${RELIGN_RUN_WITH:-} "$here/relign-bench-gpu" "${1:-$here/relign_od/scene.json}" "$here/randomisation.json"
status=$?
[ -d "$here/python" ] || exit $status
# Without the libraries above, which torch does not expect.
LD_LIBRARY_PATH="$libraries" PYTHONPATH="$here/python" ${RELIGN_RUN_WITH:-} python3 "$here/gpu_environment.py" || status=1
exit $status
RUN
chmod +x "$out/run"
tar -C "$work" -czf "$file" relign-bench-gpu
ls -l "$file"
