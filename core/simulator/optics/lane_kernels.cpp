// The double kernels of ray_lanes.h, compiled once for each instruction set (RELIGN_KERNEL_ISA). Every expression is
// that of trace.cpp and face_shape.cpp, in the same order, so that the bits are the same, too. As in block_kernels.cpp
// only builtins are called.
#include "optics/lane_block.h"

namespace relign::optics {
namespace RELIGN_KERNEL_ISA {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

void start(RayLanes& rays, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const double x = rays.dx[i], y = rays.dy[i], z = rays.dz[i];
    const double s = 1 / __builtin_sqrt(x * x + y * y + z * z);
    rays.dx[i] = s * x;
    rays.dy[i] = s * y;
    rays.dz[i] = s * z;
    rays.alive[i] = s * z > 0 ? 1.0 : 0.0;
    rays.transmittance[i] = 1;
    rays.path_mm[i] = 0;
  }
}

void pass_stop(RayLanes& rays, double z_mm, double radius_mm, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const double on = (z_mm - rays.z[i]) / rays.dz[i];
    const double x = rays.x[i] + on * rays.dx[i], y = rays.y[i] + on * rays.dy[i];
    rays.alive[i] = x * x + y * y > radius_mm * radius_mm ? 0.0 : rays.alive[i];
  }
}

void enter(RayLanes& rays, const LaneFace& face, int count) {
  const double r0 = face.into[0], r1 = face.into[1], r2 = face.into[2], r3 = face.into[3], r4 = face.into[4],
               r5 = face.into[5], r6 = face.into[6], r7 = face.into[7], r8 = face.into[8];
  const double tx = face.into_shift[0], ty = face.into_shift[1], tz = face.into_shift[2], vertex = face.z_mm;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const double x = rays.x[i], y = rays.y[i], z = rays.z[i];
    rays.px[i] = r0 * x + r1 * y + r2 * z + tx;
    rays.py[i] = r3 * x + r4 * y + r5 * z + ty;
    rays.pz[i] = r6 * x + r7 * y + r8 * z + tz - vertex;
    const double dx = rays.dx[i], dy = rays.dy[i], dz = rays.dz[i];
    rays.lx[i] = r0 * dx + r1 * dy + r2 * dz;
    rays.ly[i] = r3 * dx + r4 * dy + r5 * dz;
    rays.lz[i] = r6 * dx + r7 * dy + r8 * dz;
  }
}

void meet_conic(RayLanes& rays, const LaneFace& face, int count) {
  const double c = face.curvature, conic = face.conic, kappa = 1 + face.conic;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const double lx = rays.lx[i], ly = rays.ly[i], lz = rays.lz[i];
    const double along = rays.px[i] * lx + rays.py[i] * ly + rays.pz[i] * lz;
    const double mx = rays.px[i] - along * lx, my = rays.py[i] - along * ly, mz = rays.pz[i] - along * lz;
    const double a = c * (1 + conic * lz * lz);
    const double b = lz - c * (mx * lx + my * ly + kappa * mz * lz);
    const double f = c * (mx * mx + my * my + kappa * mz * mz) - 2 * mz;
    const double discriminant = b * b - a * f;
    const double alive = discriminant > 0 ? rays.alive[i] : 0.0;
    const double t = f / (b + __builtin_copysign(__builtin_sqrt(discriminant > 0 ? discriminant : 1.0), lz));
    const double x = mx + t * lx, y = my + t * ly, z = mz + t * lz;
    const double root = 1 - kappa * c * z;
    rays.alive[i] = root > 0 ? alive : 0.0;
    const double nx = -c * x, ny = -c * y;
    const double s = 1 / __builtin_sqrt(nx * nx + ny * ny + root * root);
    rays.hx[i] = x;
    rays.hy[i] = y;
    rays.hz[i] = z;
    rays.nx[i] = s * nx;
    rays.ny[i] = s * ny;
    rays.nz[i] = s * root;
  }
}

template <bool Mirror>
void refract_at(RayLanes& rays, const LaneFace& face, int count) {
  const double r0 = face.out[0], r1 = face.out[1], r2 = face.out[2], r3 = face.out[3], r4 = face.out[4],
               r5 = face.out[5], r6 = face.out[6], r7 = face.out[7], r8 = face.out[8];
  const double tx = face.out_shift[0], ty = face.out_shift[1], tz = face.out_shift[2], vertex = face.z_mm;
  const double before = face.before, behind = face.behind, ratio = before / behind, sign = face.normal_sign;
  const double clear2 = face.clear_mm * face.clear_mm, stop2 = face.stop_mm * face.stop_mm;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const double nx = sign * rays.nx[i], ny = sign * rays.ny[i], nz = sign * rays.nz[i];  // along the light
    const double lx = rays.lx[i], ly = rays.ly[i], lz = rays.lz[i];
    const double cosine = lx * nx + ly * ny + lz * nz;
    double alive = cosine > 0 ? rays.alive[i] : 0.0;
    const double hx = rays.hx[i], hy = rays.hy[i], hz = rays.hz[i];
    const double r2_here = hx * hx + hy * hy;
    alive = r2_here > clear2 ? 0.0 : alive;
    alive = r2_here > stop2 ? 0.0 : alive;
    const double refracted = 1 - ratio * ratio * (1 - cosine * cosine);
    alive = refracted > 0 ? alive : 0.0;
    const double cosine_behind = __builtin_sqrt(refracted > 0 ? refracted : 1.0);
    const double across = (before * cosine - behind * cosine_behind) / (before * cosine + behind * cosine_behind);
    const double along = (before * cosine_behind - behind * cosine) / (before * cosine_behind + behind * cosine);
    if constexpr (!Mirror) rays.transmittance[i] *= 1 - (across * across + along * along) / 2;
    const double g = Mirror ? -2 * cosine : cosine_behind - ratio * cosine;
    const double ox = ratio * lx + g * nx, oy = ratio * ly + g * ny, oz = ratio * lz + g * nz;
    const double z = hz + vertex;
    const double x1 = r0 * hx + r1 * hy + r2 * z + tx;
    const double y1 = r3 * hx + r4 * hy + r5 * z + ty;
    const double z1 = r6 * hx + r7 * hy + r8 * z + tz;
    rays.path_mm[i] +=
        before * ((x1 - rays.x[i]) * rays.dx[i] + (y1 - rays.y[i]) * rays.dy[i] + (z1 - rays.z[i]) * rays.dz[i]);
    rays.x[i] = x1;
    rays.y[i] = y1;
    rays.z[i] = z1;
    rays.dx[i] = r0 * ox + r1 * oy + r2 * oz;
    rays.dy[i] = r3 * ox + r4 * oy + r5 * oz;
    rays.dz[i] = r6 * ox + r7 * oy + r8 * oz;
    rays.alive[i] = alive;
  }
}

void refract(RayLanes& rays, const LaneFace& face, int count) {
  (face.mirror ? refract_at<true> : refract_at<false>)(rays, face, count);
}

}  // namespace

extern const LaneKernels lane_kernels = {start, pass_stop, enter, meet_conic, refract};

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
