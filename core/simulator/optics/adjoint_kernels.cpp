// The kernels of adjoint_block.h, compiled once for each instruction set (RELIGN_KERNEL_ISA) like block_kernels.cpp: loops
// over blocks of rays around the arithmetic of one ray (adjoint_steps.h).
#include "optics/adjoint_steps.h"
#include "optics/ray_block.h"

namespace relign::optics {
namespace RELIGN_KERNEL_ISA {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

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

// Of the coordinates of the hit, and of the light.
struct Traced {
  Adjoints x, y, light;
};

void from_emitter(Traced& all, const float* state, float distance_z, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    put(all.x, i, hit_back(recorded(state, i), distance_z, 1.0F, 0.0F));
    put(all.y, i, hit_back(recorded(state, i), distance_z, 0.0F, 1.0F));
    put(all.light, i, {0, 0, 0, 0, 0, 0});
  }
}

// The kind is known to the compiler, so that nothing is chosen in the loop.
template <OpKinds::Kind Kind, Carries Light>
void each_back(Traced& all, const Op& given, const float* before, int count) {
  Op op = given;
  op.kind = Kind;
  const float* const behind = before + kStateNumbers * kBlockRays;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const FloatRay from = recorded(before, i), to = recorded(behind, i);
    AdjointOf<float> x = taken(all.x, i), y = taken(all.y, i), light = taken(all.light, i);
    operation_back<Carries::position>(x, op, from, to);
    operation_back<Carries::position>(y, op, from, to);
    operation_back<Light>(light, op, from, to);
    put(all.x, i, x);
    put(all.y, i, y);
    put(all.light, i, light);
  }
}

template <Carries Light>
void back_over(Traced& all, const Op& op, const float* before, int count) {
  switch (op.kind) {
    case Op::frame:
      return each_back<Op::frame, Light>(all, op, before, count);
    case Op::shift:
      return;
    case Op::face:
      return each_back<Op::face, Light>(all, op, before, count);
    case Op::asphere:
      return each_back<Op::asphere, Light>(all, op, before, count);
    case Op::stop:
      return each_back<Op::stop, Light>(all, op, before, count);
    case Op::bore:
      return each_back<Op::bore, Light>(all, op, before, count);
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

template <bool Follow, bool Light>
void read_wrench(const Adjoints& all, const float* state, const ReadingPlace& given, const PupilPlane& given_pupil,
                 float* wrench, int count) {
  const ReadingPlace place = given;
  const PupilPlane pupil = given_pupil;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const FloatRay ray = in_lens(recorded(state, i), place);
    const AdjointOf<float> a = in_lens(taken(all, i), place);
    WrenchOf<float> w = wrench_of(ray, a);
    if (Follow) {
      const WrenchOf<float> moved = pupil_wrench<Light>(ray, a, pupil.z, pupil.across);
      w = {w.fx - moved.fx, w.fy - moved.fy, w.fz - moved.fz, w.tx - moved.tx, w.ty - moved.ty, w.tz - moved.tz};
    }
    wrench[i] = w.fx;
    wrench[kBlockRays + i] = w.fy;
    wrench[2 * kBlockRays + i] = w.fz;
    wrench[3 * kBlockRays + i] = w.tx;
    wrench[4 * kBlockRays + i] = w.ty;
    wrench[5 * kBlockRays + i] = w.tz;
  }
}

template <bool Follow>
void read_place(const Traced& all, const float* state, const ReadingPlace& place, const PupilPlane& pupil,
                float* wrenches, int count) {
  constexpr int kNext = kWrenchNumbers * kBlockRays;
  read_wrench<Follow, false>(all.x, state, place, pupil, wrenches, count);
  read_wrench<Follow, false>(all.y, state, place, pupil, wrenches + kNext, count);
  read_wrench<Follow, true>(all.light, state, place, pupil, wrenches + 2 * kNext, count);
}

void trace_back(const Op* ops, int op_count, bool fresnel, const float* record, float distance_z,
                const ReadingPlace* places, int place_count, const PupilPlane* follow, float* wrenches, int count) {
  const auto state = [&](int k) { return record + k * kStateNumbers * kBlockRays; };
  Traced all;
  from_emitter(all, state(op_count), distance_z, count);
  int place = place_count - 1;
  for (int k = op_count; k >= 0; --k) {
    for (; place >= 0 && places[place].before == k; --place) {
      float* const here = wrenches + place * kPlaceNumbers * kBlockRays;
      if (place == 1 && follow)
        read_place<true>(all, state(k), places[place], *follow, here, count);
      else
        read_place<false>(all, state(k), places[place], {}, here, count);
    }
    if (k > 0)
      (fresnel ? back_over<Carries::light> : back_over<Carries::light_free>)(all, ops[k - 1], state(k - 1), count);
  }
}

// Of a ray: factors of the wrenches of its hit's x and y and of its light.
struct Factors {
  float x[kBlockRays], y[kBlockRays], light[kBlockRays];
};

template <bool EightBits>
void find_factors(const RayBlock& block, const EmitterPlane& given, bool fresnel, float bound, const PixelSteps& given_steps,
                  const float* at_sensor, Factors& factors, int count) {
  const EmitterPlane emitter = given;
  const PixelSteps steps = given_steps;
  const float per_bound = 1.0F / bound;
  const float cell_x = steps.pitch_x / kCells, cell_y = steps.pitch_y / kCells;
  const float* const by_x = at_sensor;
  const float* const by_y = at_sensor + kWrenchNumbers * kBlockRays;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float x1 = by_x[i], x2 = by_x[kBlockRays + i], x3 = by_x[2 * kBlockRays + i];
    const float y1 = by_y[i], y2 = by_y[kBlockRays + i], y3 = by_y[2 * kBlockRays + i];
    const HitSteps hit = {cell_x * (steps.x[0] * x1 + steps.x[1] * x2 + steps.x[2] * x3),
                          cell_x * (steps.x[0] * y1 + steps.x[1] * y2 + steps.x[2] * y3),
                          cell_y * (steps.y[0] * x1 + steps.y[1] * x2 + steps.y[2] * x3),
                          cell_y * (steps.y[0] * y1 + steps.y[1] * y2 + steps.y[2] * y3)};
    const float u = place_in_cell(unit_of_word(block.u0[i])), v = place_in_cell(unit_of_word(block.u1[i]));
    const MeanSlope slope = mean_slope<EightBits>(emitter, block.x[i], block.y[i], hit, u, v);
    const bool passed = block.margin[i] > 0.0F;
    const float transmitted = fresnel ? block.above[i] / (block.below[i] * block.below[i]) : 1.0F;
    const float weight = passed ? per_bound * transmitted : 0.0F;
    factors.x[i] = slope.x != 0.0F ? weight * slope.x : 0.0F;
    factors.y[i] = slope.y != 0.0F ? weight * slope.y : 0.0F;
    factors.light[i] = block.radiance[i] > 0.0F ? weight * block.radiance[i] : 0.0F;
  }
}

void differentiate(const RayBlock& block, const EmitterPlane& emitter, bool fresnel, float bound, const PixelSteps& steps,
                   const float* at_sensor, const float* wrenches, const PartBetween* parts, int part_count,
                   float* derivatives, int count) {
  Factors factors;
  (emitter.texels_8_bit ? find_factors<true> : find_factors<false>)(block, emitter, fresnel, bound, steps, at_sensor,
                                                                  factors, count);
  constexpr int kNext = kWrenchNumbers * kBlockRays;
  for (int part = 0; part < part_count; ++part) {
    const float* const into = wrenches + parts[part].into * kPlaceNumbers * kBlockRays;
    const float* const out = wrenches + parts[part].out * kPlaceNumbers * kBlockRays;
    for (int k = 0; k < kWrenchNumbers; ++k) {
      const float* const from = into + k * kBlockRays;
      const float* const to = out + k * kBlockRays;
      float* const derivative = derivatives + (part * kWrenchNumbers + k) * kBlockRays;
      RELIGN_LOOP
      for (int i = 0; i < count; ++i) {
        const float total = factors.x[i] * (to[i] - from[i]) + factors.y[i] * (to[kNext + i] - from[kNext + i]) +
                            factors.light[i] * (to[2 * kNext + i] - from[2 * kNext + i]);
        // NaN is of rays that were lost on their way.
        derivative[i] = block.margin[i] > 0.0F && total == total ? total : 0.0F;
      }
    }
  }
}

}  // namespace

extern const AdjointKernels adjoint_kernels = {trace_back, differentiate};

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
