// The kernels of ghost_block.h, compiled once for each instruction set (RELIGN_KERNEL_ISA) like block_kernels.cpp:
// loops over blocks of rays around the arithmetic of one ray (ghost_steps.h).
#include "optics/ghost_block.h"
#include "optics/ghost_steps.h"

namespace relign::optics {
namespace RELIGN_KERNEL_ISA {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

// Rays of a block as arrays, which is what the compiler vectorises best.
struct Rays {
  float x[kGhostRays], y[kGhostRays], z[kGhostRays], l[kGhostRays], m[kGhostRays], n[kGhostRays], weight[kGhostRays];
  std::uint32_t tag[kGhostRays];
};

// Not inlined, since GCC then warns of arrays without values wherever `count` might be 0.
[[gnu::noinline]] void load(Rays& __restrict rays, const GhostRay* __restrict from, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    rays.x[i] = from[i].x;
    rays.y[i] = from[i].y;
    rays.z[i] = from[i].z;
    rays.l[i] = from[i].l;
    rays.m[i] = from[i].m;
    rays.n[i] = from[i].n;
    rays.weight[i] = from[i].weight;
    rays.tag[i] = from[i].tag;
  }
}

void store(GhostRay* __restrict to, const Rays& __restrict rays, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    to[i].x = rays.x[i];
    to[i].y = rays.y[i];
    to[i].z = rays.z[i];
    to[i].l = rays.l[i];
    to[i].m = rays.m[i];
    to[i].n = rays.n[i];
    to[i].weight = rays.weight[i];
    to[i].tag = rays.tag[i];
  }
}

RELIGN_DEVICE GhostLine ray_at(const Rays& rays, int i) {
  return {rays.x[i], rays.y[i], rays.z[i], rays.l[i], rays.m[i], rays.n[i], rays.tag[i]};
}

// GhostMeetings and GhostWays as arrays.
struct Meetings {
  float x[kGhostRays], y[kGhostRays], z[kGhostRays];
  float normal_x[kGhostRays], normal_y[kGhostRays], normal_z[kGhostRays];
  float cosine[kGhostRays], ratio[kGhostRays];
  std::int32_t met[kGhostRays], elsewhere[kGhostRays];
  std::uint32_t tag[kGhostRays];
  float through_l[kGhostRays], through_m[kGhostRays], through_n[kGhostRays];
  float back_l[kGhostRays], back_m[kGhostRays], back_n[kGhostRays];
  float reflectance[kGhostRays];
  std::int32_t through_to[kGhostRays], back_to[kGhostRays];
};

RELIGN_DEVICE void put(const GhostMeeting& from, Meetings& at, int i) {
  at.x[i] = from.x;
  at.y[i] = from.y;
  at.z[i] = from.z;
  at.normal_x[i] = from.normal_x;
  at.normal_y[i] = from.normal_y;
  at.normal_z[i] = from.normal_z;
  at.cosine[i] = from.cosine;
  at.ratio[i] = from.ratio;
  at.met[i] = from.met;
  at.elsewhere[i] = from.elsewhere;
  at.tag[i] = from.tag;
  at.through_to[i] = from.through_to;
  at.back_to[i] = from.back_to;
}

RELIGN_DEVICE GhostMeeting meeting_at(const Meetings& at, int i) {
  return {at.x[i],     at.y[i],   at.z[i],         at.normal_x[i], at.normal_y[i],   at.normal_z[i], at.cosine[i],
          at.ratio[i], at.met[i], at.elsewhere[i], at.tag[i],      at.through_to[i], at.back_to[i]};
}

RELIGN_DEVICE GhostWays ways_at(const Meetings& at, int i) {
  return {at.through_l[i], at.through_m[i], at.through_n[i],  at.back_l[i],
          at.back_m[i],    at.back_n[i],    at.reflectance[i]};
}

void weigh(Meetings& __restrict at, const Rays& __restrict rays, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const GhostWays ways = ways_on(meeting_at(at, i), rays.l[i], rays.m[i], rays.n[i]);
    at.through_l[i] = ways.through_l;
    at.through_m[i] = ways.through_m;
    at.through_n[i] = ways.through_n;
    at.back_l[i] = ways.back_l;
    at.back_m[i] = ways.back_m;
    at.back_n[i] = ways.back_n;
    at.reflectance[i] = ways.reflectance;
  }
}

void go_both_ways(const Meetings& __restrict at, const Rays& __restrict rays, const GhostChoice& choice,
                  GhostChildren& __restrict children, Rays& __restrict first, Rays& __restrict second, int count) {
  const float least_weight = choice.least_weight, least_faint = choice.least_faint;
  const std::uint32_t *const words = choice.words, *const more = choice.more_words;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const bool met = at.met[i] != 0;
    const std::uint32_t tag = at.tag[i], old = rays.tag[i];
    const float weight = rays.weight[i], reflectance = at.reflectance[i];
    const float least = (tag & kGhostFaint) != 0 ? least_faint : least_weight;
    const float through = weight * (1.0F - reflectance), back = weight * reflectance;
    const bool going = (tag & kGhostEventMask) < kGhostEvents * kGhostEvent;
    const bool kept = (through >= least) | (unit_of_word(words[i]) * least < through);
    const bool turned = (back >= least) | (unit_of_word(more[i]) * least < back);
    const bool stays = met & going & (reflectance < 1.0F) & kept, turns = met & going & turned;
    const std::int32_t through_to = at.through_to[i], back_to = at.back_to[i], elsewhere = at.elsewhere[i];
    const float x = rays.x[i], y = rays.y[i], z = rays.z[i], l = rays.l[i], m = rays.m[i], n = rays.n[i];
    const float hx = at.x[i], hy = at.y[i], hz = at.z[i];
    const float tl = at.through_l[i], tm = at.through_m[i], tn = at.through_n[i];
    first.x[i] = met ? hx : x;
    first.y[i] = met ? hy : y;
    first.z[i] = met ? hz : z;
    first.l[i] = met ? tl : l;
    first.m[i] = met ? tm : m;
    first.n[i] = met ? tn : n;
    first.weight[i] = met ? larger(through, least) : weight;
    first.tag[i] = met ? tag : old;
    children.first_to[i] = met ? (stays ? through_to : kGhostGone) : elsewhere;
    second.x[i] = hx;
    second.y[i] = hy;
    second.z[i] = hz;
    second.l[i] = at.back_l[i];
    second.m[i] = at.back_m[i];
    second.n[i] = at.back_n[i];
    second.weight[i] = larger(back, least);
    second.tag[i] = tag | kGhostReflected;
    children.second_to[i] = turns ? back_to : kGhostGone;
  }
  store(children.first, first, count);
  store(children.second, second, count);
}

void go_one_way(const Meetings& __restrict at, const Rays& __restrict rays, const GhostChoice& choice,
                GhostChildren& __restrict children, Rays& __restrict first, int count) {
  const std::uint32_t *const words = choice.words, *const more = choice.more_words;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    std::int32_t to = 0;
    const GhostRay ray =
        one_way_on(meeting_at(at, i), ways_at(at, i), ray_at(rays, i), rays.weight[i], words[i], more[i], to);
    first.x[i] = ray.x;
    first.y[i] = ray.y;
    first.z[i] = ray.z;
    first.l[i] = ray.l;
    first.m[i] = ray.m;
    first.n[i] = ray.n;
    first.weight[i] = ray.weight;
    first.tag[i] = ray.tag;
    children.first_to[i] = to;
  }
  store(children.first, first, count);
}

// Arrays of one thread's block.
struct Work {
  Rays rays, first, second;
  Meetings at;
};

void go_on(Work& work, const GhostChoice& choice, GhostChildren& children, int count) {
  if (choice.both)
    go_both_ways(work.at, work.rays, choice, children, work.first, work.second, count);
  else
    go_one_way(work.at, work.rays, choice, children, work.first, count);
}

// The surface that rays come from is met again on its concave side only.
template <bool Concave>
RELIGN_DEVICE float distance_again(const GhostStep& step, const GhostLine& ray) {
  return Concave ? ghost_chord(step.left, ray) : kGhostNever;
}

template <bool Concave, bool HoldsStop>
void advance_to_face(const GhostStep& given, const GhostLens& lens, const Rays& __restrict rays,
                     Meetings& __restrict at, int count) {
  const GhostStep step = given;
  float absorbed[kGhostRays];
  if (HoldsStop) {
    for (int i = 0; i < count; ++i) absorbed[i] = kGhostNever;
    for (int k = 0; k < lens.stop_count; ++k) {
      const GhostStop stop = lens.stops[k];
      RELIGN_LOOP
      for (int i = 0; i < count; ++i) absorbed[i] = absorbed_by(stop, ray_at(rays, i), absorbed[i]);
    }
  }
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const GhostLine ray = ray_at(rays, i);
    put(meet_next_face(step, ray, distance_again<Concave>(step, ray), HoldsStop ? absorbed[i] : kGhostNever), at, i);
  }
}

template <bool Concave>
void advance_to_stop(const GhostStep& given, const Rays& __restrict rays, GhostChildren& __restrict children,
                     int count) {
  const GhostStep step = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const GhostLine ray = ray_at(rays, i);
    children.first_to[i] = past_stop(step, ray, distance_again<Concave>(step, ray));
  }
}

template <bool Concave>
void advance_to_end(const GhostStep& given, const Rays& __restrict rays, GhostChildren& __restrict children,
                    int count) {
  const GhostStep step = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const GhostLine ray = ray_at(rays, i);
    children.first_to[i] = past_end(step, ray, distance_again<Concave>(step, ray));
  }
}

void advance(const GhostStep& step, const GhostLens& lens, const GhostRay* from, const GhostChoice& choice,
             GhostChildren& children, int count) {
  Work work;
  load(work.rays, from, count);
  if (step.kind != GhostStep::face) {
    if (step.kind == GhostStep::stop)
      (step.concave ? advance_to_stop<true> : advance_to_stop<false>)(step, work.rays, children, count);
    else
      (step.concave ? advance_to_end<true> : advance_to_end<false>)(step, work.rays, children, count);
    store(children.first, work.rays, count);
    for (int i = 0; i < count; ++i) children.second_to[i] = kGhostGone;
    return;
  }
  if (step.holds_stop)
    (step.concave ? advance_to_face<true, true> : advance_to_face<false, true>)(step, lens, work.rays, work.at, count);
  else
    (step.concave ? advance_to_face<true, false> : advance_to_face<false, false>)(step, lens, work.rays, work.at,
                                                                                  count);
  weigh(work.at, work.rays, count);
  go_on(work, choice, children, count);
}

#include "optics/ghost_search.inc"

}  // namespace

extern const GhostKernels ghost_kernels = {advance, search};

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
