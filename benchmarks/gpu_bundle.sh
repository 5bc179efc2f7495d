#!/bin/sh
# gpu_bundle.sh BUILD_FOLDER FILE.tgz [WHEEL]: packs relign-bench-gpu, the libraries it needs and a scene, so that it
# runs on another machine with NVIDIA's driver and NVRTC, without this project's dependencies:
#
#   ./quickstart wheel                                            # here
#   benchmarks/gpu_bundle.sh build/release gpu.tgz dist/*.whl     # here
#   tar xzf gpu.tgz && RELIGN_TEST_GPU=1 relign-bench-gpu/run   # there: prints the table, and runs tests
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
# With the self-contained wheel the environment and a training are measured as well, where python3 has its version, torch,
# gymnasium and stable-baselines3, and the tests that a GPU can run are there.
if [ $# -gt 2 ]; then
  cp "$here/benchmarks/gpu_environment.py" "$here/benchmarks/gpu_training.py" "$out/"
  mkdir -p "$out/tests/python"
  for name in support test_cuda test_cuda_training test_graphs; do cp "$here/tests/python/$name.py" "$out/tests/python/"; done
  python3 -m zipfile -e "$3" "$out/python"
  # Of the wheel, only the plugins of the environment and the libraries that they and the module need: a third of it.
  package=$out/python/relign_bench
  rm -rf "$package/bin"
  find "$package/lib/relign-bench/plugins" -mindepth 1 -maxdepth 1 ! -name lens_system ! -name rho ! -name tolerances -exec rm -r {} +
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
export LD_LIBRARY_PATH="$libraries" PYTHONPATH="$here/python${PYTHONPATH:+:$PYTHONPATH}"
for program in gpu_environment gpu_training; do
  ${RELIGN_RUN_WITH:-} python3 "$here/$program.py" || status=1
done
[ "${RELIGN_TEST_GPU:-}" != 1 ] || (cd "$here/tests/python" && python3 -m unittest test_cuda test_cuda_training test_graphs) || status=1
exit $status
RUN
chmod +x "$out/run"
tar -C "$work" -czf "$file" relign-bench-gpu
ls -l "$file"
