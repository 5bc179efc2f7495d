// GhostWalk: refraction at every face equals the sequential trace; reflections obey the law; stops absorb.
#include "optics/ghost_walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <relign/random.hpp>
#include <utility>
#include <vector>

#include "lens_under_test.h"
#include "optics/ghost_steps.h"
#include "optics/ghost_tables.h"
#include "optics/ray_block.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

using Next = GhostWalk::Next;

double distance(const Vec3& a, const Vec3& b) { return std::sqrt(dot(a - b, a - b)); }

TEST(GhostWalk, MatchesSequentialTraceWithoutReflections) {
  const Prescription& lens = relign_od();
  const Assembly assembly(lens, {{"L2", {{0.01, -0.02, 0.005}, {0.3, -0.2}}}, {"L4", {{0, 0.01, 0}, {-0.4, 0.1}}}});
  GhostWalk walk;
  walk.set(assembly);
  int compared = 0;
  for (int field = -30; field <= 30; field += 10)
    for (int height = -2; height <= 2; ++height) {
      const double tangent = std::tan(field * 3.14159265358979 / 180);
      const Vec3 direction = unit({0.02, tangent, 1});
      const TracedRay forward = trace(assembly, {{0.1, 0.2 * height - 6 * tangent, -0.5}, direction}, Apertures::mesh);
      if (!forward.passed) continue;
      ++compared;
      WalkingRay ray;
      ASSERT_TRUE(walk.enter_from_image(forward.image, -1.0 * forward.exit_direction, ray));
      AtFace met;
      for (std::size_t face = forward.hits.size(); face-- > 0;) {
        ASSERT_EQ(walk.advance(ray, met), Next::face);
        ASSERT_FALSE(met.is_edge);
        EXPECT_LT(distance(met.at, forward.hits[face]), 1e-9);
        walk.refract(met, ray);
      }
      EXPECT_EQ(walk.advance(ray, met), Next::object_side);
      EXPECT_LT(distance(ray.direction, -1.0 * direction), 1e-10);
    }
  EXPECT_GT(compared, 10);
}

// Normal incidence: reflectance ((n - 1) / (n + 1))^2 at every face; a ray on the axis returns on its path.
TEST(GhostWalk, ReflectsOnTheAxis) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens));
  WalkingRay ray;
  ASSERT_TRUE(walk.enter_from_image({0, 0, 20}, {0, 0, -1}, ray));
  AtFace met;
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  const double n = lens.elements[3].faces[0].index_after;
  EXPECT_NEAR(met.reflectance, std::pow((n - 1) / (n + 1), 2), 1e-12);
  walk.refract(met, ray);
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  EXPECT_NEAR(met.reflectance, std::pow((n - 1) / (n + 1), 2), 1e-12);
  walk.reflect(met, ray);
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  EXPECT_NEAR(met.at.z, 17.141761, 1e-12);
  walk.refract(met, ray);
  EXPECT_EQ(walk.advance(ray, met), Next::image_side);
  EXPECT_NEAR(ray.direction.z, 1, 1e-15);
}

// L1's back is nearly a hemisphere: a grazing ray hits its concave side again before it leaves.
TEST(GhostWalk, HitsConcaveFaceTwice) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens));
  const double radius = 2.95545, centre = 1.5 + radius;
  WalkingRay ray{{2.6, 0, 6}, {0, 0, -1}, 3, 0, false, -1};
  AtFace met;
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  for (int bounce = 0; bounce < 2; ++bounce) {
    EXPECT_EQ(met.surface, 1) << "bounce " << bounce;
    EXPECT_NEAR(distance(met.at, {0, 0, centre}), radius, 1e-10);
    walk.reflect(met, ray);
    ASSERT_EQ(walk.advance(ray, met), Next::face);
  }
  EXPECT_LT(met.at.x, 0) << "on the other side of the axis";
}

TEST(GhostWalk, StopsAndBarrelAbsorb) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens));
  AtFace met;
  // Between aperture stop and L1, slightly too high for the front stop, which is within the depth of L1's concave back.
  WalkingRay at_stop{{2.775, 0, 8}, {0, 0, -1}, 3, 0, false, -1};
  EXPECT_EQ(walk.advance(at_stop, met), Next::lost);
  // Higher, the stop is inside L1's glass.
  WalkingRay behind_glass{{3.2, 0, 8}, {0, 0, -1}, 3, 0, false, -1};
  ASSERT_EQ(walk.advance(behind_glass, met), Next::face);
  EXPECT_TRUE(met.is_edge);
  walk.refract(met, behind_glass);
  EXPECT_EQ(walk.advance(behind_glass, met), Next::lost);
  // Beside L4, towards the bore.
  WalkingRay at_bore{{3.5, 0, 18}, unit({1, 0, -1}), -1, 0, false, -1};
  EXPECT_EQ(walk.advance(at_bore, met), Next::lost);
  // From outside of the bore at the rear.
  WalkingRay ray;
  EXPECT_FALSE(walk.enter_from_image({5.2, 0, 20.7}, {0, 0, -1}, ray));
}

// A ray outside the clear aperture hits the ring at L4's rim and enters the glass there.
TEST(GhostWalk, EdgesRefract) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens));
  WalkingRay ray;
  ASSERT_TRUE(walk.enter_from_image({3.0, 0, 20}, {0, 0, -1}, ray));
  AtFace met;
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  EXPECT_TRUE(met.is_edge);
  EXPECT_NEAR(met.at.z, 17.4875, 1e-3);
  walk.refract(met, ray);
  EXPECT_GT(ray.glass, 0);
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  EXPECT_NEAR(dot(ray.direction, ray.direction), 1, 1e-12);
}

// A block of rays in one queue; those that only passed a stop or must be searched are advanced further, so that each
// has met a face or an edge, left the lens or is lost, as after GhostWalk::advance.
struct Advanced {
  GhostRay refracted, reflected;
  int refracted_to = kGhostGone, reflected_to = kGhostGone;
};

std::vector<Advanced> advance_in_blocks(const GhostTables& tables, const BlockKernels& kernels,
                                        const std::vector<GhostRay>& rays, const std::vector<int>& queues) {
  std::vector<Advanced> results(rays.size());
  std::vector<std::pair<GhostRay, int>> waiting;
  for (std::size_t i = 0; i < rays.size(); ++i) waiting.push_back({rays[i], queues[i]});
  const std::vector<std::uint32_t> zero(kGhostRays);
  const GhostChoice choice{true, 0, 0, zero.data(), zero.data()};
  const auto children = std::make_unique<GhostChildren>();
  while (!waiting.empty()) {
    const int queue = waiting.back().second;
    std::vector<GhostRay> block;
    for (std::size_t i = waiting.size(); i-- > 0 && block.size() < kGhostRays;)
      if (waiting[i].second == queue) {
        block.push_back(waiting[i].first);
        waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
      }
    const std::size_t count = block.size();
    block.resize((count + kGhostLanes - 1) / kGhostLanes * kGhostLanes, block.front());
    tables.advance(*kernels.ghosts, queue, block.data(), choice, *children, static_cast<int>(block.size()));
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t path = block[i].tag % kGhostPaths;
      const bool met = (children->first[i].tag & kGhostEventMask) != (block[i].tag & kGhostEventMask);
      const int to = children->first_to[i];
      if (!met && to >= 0 && to != tables.object_side() && to != tables.image_side())
        waiting.push_back({children->first[i], to});
      else
        results[path] = {children->first[i], children->second[i], to, children->second_to[i]};
    }
  }
  return results;
}

struct Sample {
  WalkingRay ray;
  GhostRay same{};
  int queue = 0;
};

int queue_of(const GhostTables& tables, const WalkingRay& ray) {
  return ray.gap < 0 ? tables.search_queue(0) : GhostTables::queue_of(ray.gap, ray.to_image);
}

// Rays on their way through a lens, from many random walks in double.
std::vector<Sample> rays_on_their_way(const GhostWalk& walk, const GhostTables& tables, int paths) {
  std::vector<Sample> samples;
  Random random(11);
  for (int path = 0; path < paths; ++path) {
    WalkingRay ray;
    const Vec3 from{random.uniform(-2.6, 2.6), random.uniform(-2.6, 2.6), 20.587};
    const Vec3 towards{random.uniform(-3.6, 3.6), random.uniform(-3.6, 3.6), 16};
    bool goes_on = walk.enter_from_image(from, unit(towards - from), ray);
    for (int event = 0; event < 12 && goes_on; ++event) {
      Sample sample{ray, {}, queue_of(tables, ray)};
      const auto single = [](double value) { return static_cast<float>(value); };
      sample.same = {single(ray.at.x),
                     single(ray.at.y),
                     single(ray.at.z),
                     single(ray.direction.x),
                     single(ray.direction.y),
                     single(ray.direction.z),
                     1,
                     static_cast<std::uint32_t>(samples.size()) | (ray.left >= 0 ? kGhostLeftFace : 0U)};
      samples.push_back(sample);
      AtFace met;
      goes_on = walk.advance(ray, met) == Next::face;
      if (!goes_on) break;
      if (random.uniform() < std::max(0.3, met.reflectance))
        walk.reflect(met, ray);
      else if (met.reflectance < 1)
        walk.refract(met, ray);
    }
  }
  return samples;
}

TEST(GhostBlocks, AdvanceRaysAsTheWalkInDouble) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens, {{"L2", {{0.01, -0.02, 0.005}, {0.3, -0.2}}}, {"L4", {{0, 0.01, 0}, {-0.4, 0.1}}}}));
  GhostTables tables;
  tables.set(walk);
  const std::vector<Sample> samples = rays_on_their_way(walk, tables, 20000);
  std::vector<GhostRay> rays;
  std::vector<int> queues;
  for (const Sample& sample : samples) {
    rays.push_back(sample.same);
    queues.push_back(sample.queue);
  }
  const std::vector<Advanced> found = advance_in_blocks(tables, block_kernels(), rays, queues);
  int faces = 0, edges = 0, lost = 0, away = 0, total = 0, differ = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    WalkingRay ray = samples[i].ray;
    AtFace met;
    const Next next = walk.advance(ray, met);
    const Advanced& one = found[i];
    const auto close = [](const Vec3& a, float x, float y, float z, double tolerance) {
      return distance(a, {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}) < tolerance;
    };
    bool same = false;
    switch (next) {
      case Next::object_side:
        ++away;
        same = one.refracted_to == tables.object_side();
        break;
      case Next::image_side:
        ++away;
        same = one.refracted_to == tables.image_side();
        break;
      case Next::lost:
        ++lost;
        same = one.refracted_to == kGhostGone && one.reflected_to == kGhostGone;
        break;
      case Next::face: {
        ++(met.is_edge ? edges : faces);
        total += met.reflectance == 1;
        WalkingRay turned = ray, through = ray;
        walk.reflect(met, turned);
        same = one.reflected_to == queue_of(tables, turned) &&
               close(turned.at, one.reflected.x, one.reflected.y, one.reflected.z, 1e-3) &&
               close(turned.direction, one.reflected.l, one.reflected.m, one.reflected.n, 1e-3) &&
               std::fabs(static_cast<double>(one.reflected.weight) - met.reflectance) < 1e-3;
        if (met.reflectance == 1) {
          same = same && one.refracted_to == kGhostGone;
          break;
        }
        walk.refract(met, through);
        same = same && one.refracted_to == queue_of(tables, through) &&
               close(through.direction, one.refracted.l, one.refracted.m, one.refracted.n, 5e-3);
        break;
      }
    }
    differ += !same;
  }
  // Of each kind there are enough; only rays within rounding of a rim or of grazing incidence may differ.
  EXPECT_GT(faces, 20000);
  EXPECT_GT(edges, 2000);
  EXPECT_GT(lost, 5000);
  EXPECT_GT(away, 1000);
  EXPECT_GT(total, 1000);
  EXPECT_LT(differ, static_cast<int>(samples.size()) / 2000) << "of " << samples.size();
}

TEST(GhostBlocks, AllInstructionSetsGiveTheSameBits) {
  GhostWalk walk;
  walk.set(Assembly(relign_od()));
  GhostTables tables;
  tables.set(walk);
  std::vector<GhostRay> rays;
  std::vector<int> queues;
  for (const Sample& sample : rays_on_their_way(walk, tables, 2000)) {
    rays.push_back(sample.same);
    queues.push_back(sample.queue);
  }
  const auto reference = advance_in_blocks(tables, *block_kernels("generic"), rays, queues);
  for (const char* name : {"avx2", "avx512"}) {
    const BlockKernels* kernels = block_kernels(name);
    if (!kernels) continue;
    const auto found = advance_in_blocks(tables, *kernels, rays, queues);
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_EQ(found[i].refracted_to, reference[i].refracted_to) << name;
      ASSERT_EQ(found[i].reflected_to, reference[i].reflected_to) << name;
      ASSERT_TRUE(found[i].refracted_to < 0 ||
                  std::memcmp(&found[i].refracted, &reference[i].refracted, sizeof(GhostRay)) == 0)
          << name;
      ASSERT_TRUE(found[i].reflected_to < 0 ||
                  std::memcmp(&found[i].reflected, &reference[i].reflected, sizeof(GhostRay)) == 0)
          << name;
    }
  }
}

TEST(GhostSteps, AdvanceOneRayWithTheBitsOfBlocks) {
  GhostWalk walk;
  walk.set(Assembly(relign_od()));
  GhostTables tables;
  tables.set(walk);
  std::vector<std::vector<GhostRay>> of_queues(static_cast<std::size_t>(tables.queues()));
  for (Sample sample : rays_on_their_way(walk, tables, 3000)) {
    sample.same.weight = 0.3F;
    sample.same.tag |= kGhostEvent * (sample.same.tag % 8);  // with and without roulette
    of_queues[static_cast<std::size_t>(sample.queue)].push_back(sample.same);
  }
  const auto children = std::make_unique<GhostChildren>();
  std::vector<std::uint32_t> words(kGhostRays), more_words(kGhostRays);
  const GhostChoice choice{false, 0, 0, words.data(), more_words.data()};
  Random random(3);
  int ways[3] = {0, 0, 0};  // through, back, gone
  // Rays that meet nothing next wait in queues of search or behind a stop.
  for (int pass = 0; pass < 4; ++pass)
    for (int queue = 0; queue < tables.object_side(); ++queue) {
      std::vector<GhostRay> rays;
      rays.swap(of_queues[static_cast<std::size_t>(queue)]);
      for (std::size_t first = 0; first < rays.size(); first += kGhostRays) {
        const auto count = std::min<std::size_t>(kGhostRays, rays.size() - first);
        std::vector<GhostRay> block(rays.begin() + static_cast<std::ptrdiff_t>(first),
                                    rays.begin() + static_cast<std::ptrdiff_t>(first + count));
        block.resize(kGhostRays, block.front());
        for (int i = 0; i < kGhostRays; ++i) {
          words[static_cast<std::size_t>(i)] = random.bits();
          more_words[static_cast<std::size_t>(i)] = random.bits();
        }
        tables.advance(*block_kernels().ghosts, queue, block.data(), choice, *children, kGhostRays);
        for (std::size_t i = 0; i < count; ++i) {
          GhostRay one = block[i];
          const int to = advance_ghost(tables.steps().data(), tables.lens(), queue, words[i], more_words[i], one);
          ASSERT_EQ(to, children->first_to[i]) << queue;
          if (to == kGhostGone) {
            ++ways[2];
            continue;
          }
          ASSERT_EQ(std::memcmp(&one, &children->first[i], sizeof one), 0) << queue;
          if (to < tables.object_side()) of_queues[static_cast<std::size_t>(to)].push_back(one);
          ++ways[one.n * block[i].n > 0 ? 0 : 1];
        }
      }
    }
  for (const int count : ways) EXPECT_GT(count, 500);
}

}  // namespace
}  // namespace relign::optics
