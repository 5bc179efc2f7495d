// The kernels of adjoint_block.h, compiled once for each instruction set (RELIGN_KERNEL_ISA) like block_kernels.cpp: loops
// over blocks of rays around the arithmetic of one ray (adjoint_steps.h).
#include "optics/adjoint_steps.h"
#include "optics/ray_block.h"

namespace relign::optics {
namespace RELIGN_KERNEL_ISA {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

template <bool EightBits>
void look_up_texel_slopes(RayBlock& block, const EmitterPlane& given, float edge_width, float* slope_x, float* slope_y,
                          int count) {
  const EmitterPlane emitter = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    FloatRay ray = {block.x[i], block.y[i], block.z[i], block.lx[i], block.ly[i], block.lz[i], 1, 1, block.margin[i]};
    const RadianceSlopes found = optics::look_up_slopes<EightBits>(ray, emitter, edge_width);
    block.x[i] = ray.x;
    block.y[i] = ray.y;
    block.radiance[i] = found.value;
    slope_x[i] = found.x;
    slope_y[i] = found.y;
  }
}

void look_up_slopes(RayBlock& block, const EmitterPlane& emitter, float edge_width, float* slope_x, float* slope_y,
                    int count) {
  if (emitter.texels_8_bit)
    look_up_texel_slopes<true>(block, emitter, edge_width, slope_x, slope_y, count);
  else
    look_up_texel_slopes<false>(block, emitter, edge_width, slope_x, slope_y, count);
}

RELIGN_DEVICE FloatRay recorded(const float* state, int i) {
  return {state[i],
          state[kBlockRays + i],
          state[2 * kBlockRays + i],
          state[3 * kBlockRays + i],
          state[4 * kBlockRays + i],
          state[5 * kBlockRays + i],
          1,
          1,
          1};
}

struct alignas(64) Adjoints {
  float x[kBlockRays], y[kBlockRays], z[kBlockRays], lx[kBlockRays], ly[kBlockRays], lz[kBlockRays];
};
RELIGN_DEVICE AdjointOf<float> taken(const Adjoints& all, int i) {
  return {all.x[i], all.y[i], all.z[i], all.lx[i], all.ly[i], all.lz[i]};
}
RELIGN_DEVICE void put(Adjoints& all, int i, const AdjointOf<float>& one) {
  all.x[i] = one.x;
  all.y[i] = one.y;
  all.z[i] = one.z;
  all.lx[i] = one.lx;
  all.ly[i] = one.ly;
  all.lz[i] = one.lz;
}

void from_emitter(Adjoints& all, const float* state, float distance_z, const float* slope_x, const float* slope_y,
                  int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) put(all, i, emitter_back(recorded(state, i), distance_z, slope_x[i], slope_y[i]));
}

template <class Step>
RELIGN_DEVICE void each_back(Adjoints& all, const Op& given, const float* before, const float* value, int count,
                             const Step& step) {
  const Op op = given;
  const float* const behind = before + kStateNumbers * kBlockRays;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    AdjointOf<float> one = taken(all, i);
    step(one, op, recorded(before, i), recorded(behind, i), value[i]);
    put(all, i, one);
  }
}

RELIGN_DEVICE PullsOf<float> pulls_at(const Op& op, const FloatRay& behind, float value) {
  return {value, edge_pull(op, behind.x, behind.y, value)};
}

template <bool Fresnel>
void back_over(Adjoints& all, const Op& op, const float* before, const float* value, int count) {
  using Adjoint = AdjointOf<float>;
  switch (op.kind) {
    case Op::frame:
      each_back(all, op, before, value, count,
                [](Adjoint& a, const Op& one, const FloatRay&, const FloatRay&, float) { frame_back(a, one); });
      break;
    case Op::shift:
      break;
    case Op::face:
      each_back(all, op, before, value, count,
                [](Adjoint& a, const Op& one, const FloatRay& ray, const FloatRay& behind, float f) {
                  face_back<Fresnel>(a, one, ray, behind, pulls_at(one, behind, f));
                });
      break;
    case Op::asphere:
      each_back(all, op, before, value, count,
                [](Adjoint& a, const Op& one, const FloatRay& ray, const FloatRay& behind, float f) {
                  asphere_back<Fresnel>(a, one, ray, behind, pulls_at(one, behind, f));
                });
      break;
    case Op::stop:
      each_back(all, op, before, value, count,
                [](Adjoint& a, const Op& one, const FloatRay& ray, const FloatRay& behind, float f) {
                  stop_back(a, one, ray, behind, pulls_at(one, behind, f));
                });
      break;
    case Op::bore:
      each_back(all, op, before, value, count,
                [](Adjoint& a, const Op& one, const FloatRay& ray, const FloatRay&, float f) {
                  bore_back(a, one, ray, f);
                });
      break;
  }
}

RELIGN_DEVICE FloatRay in_lens(const FloatRay& ray, const ReadingPlace& place) {
  Op op;
  for (int k = 0; k < 9; ++k) op.rotation[k] = place.rotation[k];
  for (int k = 0; k < 3; ++k) op.translation[k] = place.translation[k];
  FloatRay there = ray;
  apply_frame(there, op);
  return there;
}
RELIGN_DEVICE AdjointOf<float> in_lens(const AdjointOf<float>& a, const ReadingPlace& place) {
  const float* const r = place.rotation;
  return {r[0] * a.x + r[1] * a.y + r[2] * a.z,    r[3] * a.x + r[4] * a.y + r[5] * a.z,
          r[6] * a.x + r[7] * a.y + r[8] * a.z,    r[0] * a.lx + r[1] * a.ly + r[2] * a.lz,
          r[3] * a.lx + r[4] * a.ly + r[5] * a.lz, r[6] * a.lx + r[7] * a.ly + r[8] * a.lz};
}

// NaN, of rays that were lost on their way, becomes 0 as well.
RELIGN_DEVICE float kept(float number, float margin) { return margin > 0.0F && number == number ? number : 0.0F; }

template <bool Follow>
void read_wrench(const Adjoints& all, const RayBlock& block, const float* state, const float* value,
                 const ReadingPlace& given, const PupilPlane& given_pupil, float* wrench, int count) {
  const ReadingPlace place = given;
  const PupilPlane pupil = given_pupil;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const FloatRay ray = in_lens(recorded(state, i), place);
    const AdjointOf<float> a = in_lens(taken(all, i), place);
    WrenchOf<float> w = wrench_of(ray, a);
    if (Follow) {
      const WrenchOf<float> moved = pupil_wrench(ray, a, pupil.z, pupil.across, value[i]);
      w = {w.fx - moved.fx, w.fy - moved.fy, w.fz - moved.fz, w.tx - moved.tx, w.ty - moved.ty, w.tz - moved.tz};
    }
    const float margin = block.margin[i];
    wrench[i] = kept(w.fx, margin);
    wrench[kBlockRays + i] = kept(w.fy, margin);
    wrench[2 * kBlockRays + i] = kept(w.fz, margin);
    wrench[3 * kBlockRays + i] = kept(w.tx, margin);
    wrench[4 * kBlockRays + i] = kept(w.ty, margin);
    wrench[5 * kBlockRays + i] = kept(w.tz, margin);
  }
}

void trace_back(const RayBlock& block, const Op* ops, int op_count, bool fresnel, const float* record, float distance_z,
                const float* slope_x, const float* slope_y, const float* value, const ReadingPlace* places,
                int place_count, const PupilPlane* follow, float* wrenches, int count) {
  const auto state = [&](int k) { return record + k * kStateNumbers * kBlockRays; };
  Adjoints all;
  from_emitter(all, state(op_count), distance_z, slope_x, slope_y, count);
  int place = place_count - 1;
  for (int k = op_count; k >= 0; --k) {
    for (; place >= 0 && places[place].before == k; --place) {
      float* const wrench = wrenches + place * kWrenchNumbers * kBlockRays;
      if (place == 0 && follow)
        read_wrench<true>(all, block, state(k), value, places[place], *follow, wrench, count);
      else
        read_wrench<false>(all, block, state(k), value, places[place], {}, wrench, count);
    }
    if (k == 0 || place < 0) break;
    if (fresnel)
      back_over<true>(all, ops[k - 1], state(k - 1), value, count);
    else
      back_over<false>(all, ops[k - 1], state(k - 1), value, count);
  }
}

}  // namespace

extern const AdjointKernels adjoint_kernels = {look_up_slopes, trace_back};

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
