// The kernels of adjoint_block.h, compiled once for each instruction set (RELIGN_KERNEL_ISA) like block_kernels.cpp:
// loops over blocks of rays around the arithmetic of one ray (adjoint_steps.h).
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
template <OpKinds::Kind Kind, Carries Light, int Terms = 0, bool General = false>
void each_back(Traced& all, const Op& given, const float* before, int count) {
  Op op = given;
  op.kind = Kind;
  const float* const behind = before + kStateNumbers * kBlockRays;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    AdjointOf<float> x = taken(all.x, i), y = taken(all.y, i), light = taken(all.light, i);
    operation_back<Light, Terms, General>(x, y, light, op, recorded(before, i), recorded(behind, i));
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
      if (op.over_root || op.odd_terms > 0)
        return each_back<Op::asphere, Light, kEvenTerms, true>(all, op, before, count);
      if (op.even_terms == 0) return each_back<Op::asphere, Light>(all, op, before, count);
      if (op.even_terms <= 7) return each_back<Op::asphere, Light, 7>(all, op, before, count);
      return each_back<Op::asphere, Light, kEvenTerms>(all, op, before, count);
    case Op::stop:
      return each_back<Op::stop, Light>(all, op, before, count);
    case Op::bore:
      return each_back<Op::bore, Light>(all, op, before, count);
  }
}

void keep(const Traced& all, float* adjoints, int count) {
  const Adjoints* const traced[kTracedBack] = {&all.x, &all.y, &all.light};
  for (const Adjoints* one : traced) {
    const float* const numbers[kStateNumbers] = {one->x, one->y, one->z, one->lx, one->ly, one->lz};
    for (const float* from : numbers) {
      RELIGN_LOOP
      for (int i = 0; i < count; ++i) adjoints[i] = from[i];
      adjoints += kBlockRays;
    }
  }
}

void trace_back(const Op* ops, int op_count, bool fresnel, const float* record, float distance_z,
                const ReadingPlace* places, int place_count, float* adjoints, int count) {
  const auto state = [&](int k) { return record + k * kStateNumbers * kBlockRays; };
  Traced all;
  from_emitter(all, state(op_count), distance_z, count);
  int place = place_count - 1;
  for (int k = op_count; k >= 0; --k) {
    for (; place >= 0 && places[place].before == k; --place)
      keep(all, adjoints + place * kPlaceNumbers * kBlockRays, count);
    if (k > 0)
      (fresnel ? back_over<Carries::light> : back_over<Carries::light_free>)(all, ops[k - 1], state(k - 1), count);
  }
}

RELIGN_DEVICE AdjointOf<float> kept(const float* adjoints, int i) {
  return {adjoints[i],
          adjoints[kBlockRays + i],
          adjoints[2 * kBlockRays + i],
          adjoints[3 * kBlockRays + i],
          adjoints[4 * kBlockRays + i],
          adjoints[5 * kBlockRays + i]};
}

// The derivative of a ray's value is the sum of these, times the derivatives of its hit's x and y and of its light.
struct alignas(64) Factors {
  float x[kBlockRays], y[kBlockRays], light[kBlockRays];
};

// Four hits beside each ray's: at the far and the near end of its cell, along u, then along v; and the steps between.
struct alignas(64) Ends {
  float x[4][kBlockRays], y[4][kBlockRays], radiance[4][kBlockRays];
  float x_by_u[kBlockRays], y_by_u[kBlockRays], x_by_v[kBlockRays], y_by_v[kBlockRays];
};

// state, adjoints: at the sensor, in the first frame.
[[gnu::noinline]] void find_ends(const RayBlock& block, const SensorView& given, float texel_mm, const float* state,
                                 const float* adjoints, Ends& ends, int count) {
  const float per_cell = 1.0F / given.cells;
  const SensorView view = {{per_cell * given.u[0], per_cell * given.u[1], per_cell * given.u[2]},
                           {per_cell * given.v[0], per_cell * given.v[1], per_cell * given.v[2]},
                           given.cells,
                           given.pupil};
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const FloatRay ray = recorded(state, i);
    const AdjointOf<float> x = kept(adjoints, i), y = kept(adjoints + kStateNumbers * kBlockRays, i);
    ends.x_by_u[i] = hit_step(ray, x, view, view.u);
    ends.y_by_u[i] = hit_step(ray, y, view, view.u);
    ends.x_by_v[i] = hit_step(ray, x, view, view.v);
    ends.y_by_v[i] = hit_step(ray, y, view, view.v);
  }
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float xu = ends.x_by_u[i], yu = ends.y_by_u[i], xv = ends.x_by_v[i], yv = ends.y_by_v[i];
    const float plain = spread_of({xu, yu, xv, yv}) > 0.0F ? 1.0F : 0.0F, folded = 1.0F - plain;
    const float x_by_u = multiply_add(plain, xu, folded * texel_mm), y_by_u = plain * yu;
    const float x_by_v = plain * xv, y_by_v = multiply_add(plain, yv, folded * texel_mm);
    const float u = multiply_add(plain, place_in_cell(unit_of_word(block.u0[i]), view.cells), folded * 0.5F);
    const float v = multiply_add(plain, place_in_cell(unit_of_word(block.u1[i]), view.cells), folded * 0.5F);
    const float x = block.x[i], y = block.y[i];
    ends.x_by_u[i] = x_by_u;
    ends.y_by_u[i] = y_by_u;
    ends.x_by_v[i] = x_by_v;
    ends.y_by_v[i] = y_by_v;
    ends.x[0][i] = multiply_add(1.0F - u, x_by_u, x);
    ends.y[0][i] = multiply_add(1.0F - u, y_by_u, y);
    ends.x[1][i] = multiply_add(-u, x_by_u, x);
    ends.y[1][i] = multiply_add(-u, y_by_u, y);
    ends.x[2][i] = multiply_add(1.0F - v, x_by_v, x);
    ends.y[2][i] = multiply_add(1.0F - v, y_by_v, y);
    ends.x[3][i] = multiply_add(-v, x_by_v, x);
    ends.y[3][i] = multiply_add(-v, y_by_v, y);
  }
}

template <bool EightBits>
void look_up_hits(const EmitterPlane& given, const float* x, const float* y, float* radiance, int count) {
  const EmitterPlane emitter = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) radiance[i] = radiance_at<EightBits>(emitter, x[i], y[i]);
}

[[gnu::noinline]] void find_factors(const RayBlock& block, bool fresnel, float bound, const Ends& ends,
                                    Factors& factors, int count) {
  const float per_bound = 1.0F / bound, opaque = fresnel ? 1.0F : 0.0F;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const HitSteps steps = {ends.x_by_u[i], ends.y_by_u[i], ends.x_by_v[i], ends.y_by_v[i]};
    const MeanSlope slope =
        mean_slope(steps, ends.radiance[0][i] - ends.radiance[1][i], ends.radiance[2][i] - ends.radiance[3][i]);
    const float transmitted = block.above[i] / (block.below[i] * block.below[i]);
    const float weight = per_bound * (opaque > 0.0F ? transmitted : 1.0F);
    const float keeps = block.margin[i] > 0.0F ? 1.0F : 0.0F;
    factors.x[i] = keeps > 0.0F ? weight * slope.x : 0.0F;
    factors.y[i] = keeps > 0.0F ? weight * slope.y : 0.0F;
    factors.light[i] = keeps > 0.0F ? weight * block.radiance[i] : 0.0F;
  }
}

// Adds the wrench of a place, in lens coordinates, times `sign`.
template <bool Follow>
[[gnu::noinline]] void add_wrench(const RayBlock& block, const Factors& factors, const float* state,
                                  const float* adjoints, const ReadingPlace& given, const PupilPlane& given_pupil,
                                  float sign, float* derivatives, int count) {
  const ReadingPlace place = given;
  const PupilPlane pupil = given_pupil;
  constexpr int kNext = kStateNumbers * kBlockRays;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const FloatRay ray = recorded(state, i);
    const float value = factors.light[i];
    const AdjointOf<float> a = combined(kept(adjoints, i), factors.x[i], kept(adjoints + kNext, i), factors.y[i],
                                        kept(adjoints + 2 * kNext, i), value);
    WrenchOf<float> w = wrench_of(ray, a);
    if (Follow) {
      const WrenchOf<float> moved = pupil_wrench(ray, a, value, pupil.normal, pupil.distance, pupil.across);
      w = {w.fx - moved.fx, w.fy - moved.fy, w.fz - moved.fz, w.tx - moved.tx, w.ty - moved.ty, w.tz - moved.tz};
    }
    w = moved_to(w, place.rotation, place.translation);
    const float margin = block.margin[i];
    const float numbers[kWrenchNumbers] = {w.fx, w.fy, w.fz, w.tx, w.ty, w.tz};
    for (int k = 0; k < kWrenchNumbers; ++k) {
      const float one = sign * numbers[k];
      // NaN is of rays that were lost on their way.
      derivatives[k * kBlockRays + i] += margin > 0.0F && one == one ? one : 0.0F;
    }
  }
}

void differentiate(const RayBlock& block, const EmitterPlane& emitter, bool fresnel, float bound, const float* record,
                   const float* adjoints, const SensorView& view, const ReadingPlace* places, const PartBetween* parts,
                   int part_count, const PupilPlane* follow, float* derivatives, int count) {
  Ends ends;
  Factors factors;
  find_ends(block, view, 1.0F / emitter.texels_per_mm, record, adjoints, ends, count);
  for (int k = 0; k < 4; ++k)
    (emitter.texels_8_bit ? look_up_hits<true> : look_up_hits<false>)(emitter, ends.x[k], ends.y[k], ends.radiance[k],
                                                                      count);
  find_factors(block, fresnel, bound, ends, factors, count);
  for (int k = 0; k < part_count * kWrenchNumbers; ++k) {
    float* const derivative = derivatives + k * kBlockRays;
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) derivative[i] = 0;
  }
  const auto state = [&](int place) { return record + places[place].before * kStateNumbers * kBlockRays; };
  const auto adjoints_at = [&](int place) { return adjoints + place * kPlaceNumbers * kBlockRays; };
  for (int part = 0; part < part_count; ++part) {
    float* const derivative = derivatives + part * kWrenchNumbers * kBlockRays;
    const int into = parts[part].into, out = parts[part].out;
    add_wrench<false>(block, factors, state(out), adjoints_at(out), places[out], {}, 1.0F, derivative, count);
    if (part == 0 && follow)
      add_wrench<true>(block, factors, state(into), adjoints_at(into), places[into], *follow, -1.0F, derivative, count);
    else
      add_wrench<false>(block, factors, state(into), adjoints_at(into), places[into], {}, -1.0F, derivative, count);
  }
}

}  // namespace

extern const AdjointKernels adjoint_kernels = {trace_back, differentiate};

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
