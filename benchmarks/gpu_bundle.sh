#!/bin/sh
# gpu_bundle.sh BUILD_FOLDER OUT: puts relign-bench-gpu, the libraries it needs, a scene and this script's own `run` into
# a folder that works on another machine with a driver and NVRTC, without this project's dependencies:
#
#   benchmarks/gpu_bundle.sh build/release .gpu    # here
#   .gpu/run                                       # there: prints the table
set -eu
build=$1
out=$2
here=$(cd "$(dirname "$0")/.." && pwd)
mkdir -p "$out/lib"
cp "$build/benchmarks/relign-bench-gpu" "$out/"
# The C library stays that of the machine with the GPU.
ldd "$out/relign-bench-gpu" | awk '$3 ~ /^\// {print $3}' |
  grep -Ev '/(libc|libm|libdl|librt|libpthread)\.so' | xargs -I{} cp -L {} "$out/lib/"
cp -R "$here/plugins/scenes/lens_system/relign_od" "$out/"
cat > "$out/run" <<'RUN'
#!/bin/sh
here=$(cd "$(dirname "$0")" && pwd)
# NVRTC of the Python wheels is on no search path.
if [ -z "${RELIGN_LIBNVRTC:-}" ]; then
  wheel=$(python3 -c 'import glob, sys; print("".join([f for p in sys.path for f in glob.glob(p + "/nvidia/*/lib/libnvrtc.so.1[23]")][:1]))' 2>/dev/null)
  [ -z "$wheel" ] || export RELIGN_LIBNVRTC="$wheel"
fi
LD_LIBRARY_PATH="$here/lib" exec "$here/relign-bench-gpu" "${1:-$here/relign_od/scene.json}"
RUN
chmod +x "$out/run"
du -sh "$out"
