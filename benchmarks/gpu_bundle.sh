#!/bin/sh
# gpu_bundle.sh BUILD_FOLDER FILE.tgz: packs relign-bench-gpu, the libraries it needs and a scene, so that it runs on
# another machine with NVIDIA's driver and NVRTC, without this project's dependencies:
#
#   benchmarks/gpu_bundle.sh build/release gpu.tgz   # here
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
cp -R "$here/plugins/scenes/lens_system/relign_od" "$out/"
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
export LD_LIBRARY_PATH="$here/lib:${LD_LIBRARY_PATH:-}:/usr/local/nvidia/lib64"
exec ${RELIGN_RUN_WITH:-} "$here/relign-bench-gpu" "${1:-$here/relign_od/scene.json}"
RUN
chmod +x "$out/run"
tar -C "$work" -czf "$file" relign-bench-gpu
ls -l "$file"
