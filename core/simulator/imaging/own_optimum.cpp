#include "imaging/own_optimum.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "imaging/pupil_tiles.h"
#include "imaging/reference.h"

namespace relign::imaging {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

// Sums of J^T J, J^T r and r^2 of a least-squares problem.
struct NormalEquations {
  explicit NormalEquations(std::size_t axes)
      : jtj(Matrix::Zero(static_cast<int>(axes), static_cast<int>(axes))), jtr(Vector::Zero(static_cast<int>(axes))) {}
  void add(const Vector& slope, double residual) {
    jtj.noalias() += slope * slope.transpose();
    jtr += residual * slope;
    squares += residual * residual;
  }
  // A Levenberg-Marquardt step, clamped to the travel.
  std::vector<double> stepped(const std::vector<double>& pose, double damping) const {
    Matrix damped = jtj;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12 * jtj.trace();
    const Vector step = damped.ldlt().solve(jtr);
    std::vector<double> next = pose;
    for (std::size_t i = 0; i < next.size(); ++i) next[i] = std::clamp(next[i] - step[static_cast<int>(i)], 0.0, 1.0);
    return next;
  }

  Matrix jtj;
  Vector jtr;
  double squares = 0;
};

constexpr int kRaysAPlace = 16;
constexpr double kRim = 0.9;  // of the tile's ellipse, which is slightly larger than the pupil

}  // namespace

// Rays from the centres of tiles, and their hits on the emitter.
class OptimumFinder::Spots {
 public:
  Spots(const SceneFile& scene, Parallel& parallel)
      : scene_(scene), tiles_(scene, parallel), block_(std::make_unique<optics::RayBlock>()) {
    emitter_ = scene.emitter.plane();
    MountedLens perfect(scene);
    trace(perfect, std::vector<double>(scene.axes(), 0.5), targets_);
    const double half = scene.emitter.side_mm / 2;
    for (Hit& target : targets_) target.met = target.met && std::fabs(target.x) < half && std::fabs(target.y) < half;
  }

  struct Hit {
    bool met = false;
    double x = 0, y = 0;
  };
  // kRaysAPlace for each tile, in order.
  void trace(MountedLens& lens, const std::vector<double>& pose, std::vector<Hit>& hits) {
    const optics::Motion lens_to_world = scene_.lens_to_world(pose);
    optics::set_backward_path(path_, lens.assembly(), lens_to_world);
    ops_.assign(path_.ops.begin(), path_.ops.end());
    ops_.push_back(optics::last_frame_to_world(path_));
    tiles_.fit(lens, lens_to_world, path_, ops_, emitter_);
    hits.assign(tiles_.tiles().size() * kRaysAPlace, Hit());
    const optics::BlockKernels& kernels = optics::block_kernels();
    for (std::size_t index = 0; index < tiles_.tiles().size(); ++index) {
      const Tile& tile = tiles_.tiles()[index];
      if (tile.unlit || tile.whole_disc) continue;
      start(tile);
      kernels.trace(*block_, ops_.data(), static_cast<int>(ops_.size()), false, kRaysAPlace);
      kernels.look_up(*block_, emitter_, kRaysAPlace);
      for (int ray = 0; ray < kRaysAPlace; ++ray)
        if (block_->margin[ray] > 0 && block_->lz[ray] < 0)
          hits[index * kRaysAPlace + static_cast<std::size_t>(ray)] = {true, static_cast<double>(block_->x[ray]),
                                                                       static_cast<double>(block_->y[ray])};
    }
  }

  // Normal equations of the distances between hits and targets, in emitter sides; rays that do not arrive are ignored.
  NormalEquations equations(MountedLens& lens, const std::vector<double>& pose) {
    constexpr double kStep = 1e-3;
    const std::size_t axes = pose.size();
    trace(lens, pose, hits_);
    moved_.resize(axes);
    std::vector<double> step(axes);
    for (std::size_t axis = 0; axis < axes; ++axis) {
      std::vector<double> there = pose;
      step[axis] = pose[axis] < 0.5 ? kStep : -kStep;
      there[axis] += step[axis];
      trace(lens, there, moved_[axis]);
    }
    NormalEquations sums(axes);
    const double share = 1 / scene_.emitter.side_mm;
    for (std::size_t i = 0; i < hits_.size(); ++i) {
      bool met = targets_[i].met && hits_[i].met;
      for (std::size_t axis = 0; axis < axes && met; ++axis) met = moved_[axis][i].met;
      if (!met) continue;
      Vector slope_x(static_cast<int>(axes)), slope_y(static_cast<int>(axes));
      for (std::size_t axis = 0; axis < axes; ++axis) {
        slope_x[static_cast<int>(axis)] = (moved_[axis][i].x - hits_[i].x) * share / step[axis];
        slope_y[static_cast<int>(axis)] = (moved_[axis][i].y - hits_[i].y) * share / step[axis];
      }
      sums.add(slope_x, (hits_[i].x - targets_[i].x) * share);
      sums.add(slope_y, (hits_[i].y - targets_[i].y) * share);
    }
    return sums;
  }

 private:
  // A fixed pattern in the tile's ellipse: rings of 1, 5 and 10.
  void start(const Tile& tile) {
    for (int ray = 0; ray < kRaysAPlace; ++ray) {
      const int ring = ray == 0 ? 0 : ray <= 5 ? 1 : 2;
      const double radius = ring == 0 ? 0 : ring == 1 ? kRim * 0.5 : kRim;
      const double turns = ring == 1 ? (ray - 1) / 5.0 : (ray - 6) / 10.0;
      const optics::SineCosine angle = optics::sine_cosine_of_degrees(360 * turns);
      const double u = radius * angle.cosine, v = radius * angle.sine;
      const optics::TileStart& from = tile.start;
      const double p = static_cast<double>(from.centre[0]) + static_cast<double>(from.axes[0]) * u;
      const double q = static_cast<double>(from.centre[1]) + static_cast<double>(from.axes[2]) * u +
                       static_cast<double>(from.axes[3]) * v;
      const double rest = std::max(0.0, 1 - p * p - q * q);
      const optics::Vec3 direction = path_.into_first_frame.direction({p, q, -std::sqrt(rest)});
      const optics::Vec3 place = path_.into_first_frame.point(middle_of(scene_.sensor, tile.box));
      block_->x[ray] = static_cast<float>(place.x);
      block_->y[ray] = static_cast<float>(place.y);
      block_->z[ray] = static_cast<float>(place.z);
      block_->lx[ray] = static_cast<float>(direction.x);
      block_->ly[ray] = static_cast<float>(direction.y);
      block_->lz[ray] = static_cast<float>(direction.z);
      block_->margin[ray] = 1;
    }
  }

  const SceneFile& scene_;
  PupilTiles tiles_;
  optics::BackwardPath path_;
  std::vector<optics::Op> ops_;
  optics::EmitterPlane emitter_{};
  std::unique_ptr<optics::RayBlock> block_;
  // Hits of the perfect lens at the nominal pose, ray by ray: its aberrations and focus are part of the goal.
  std::vector<Hit> targets_;
  std::vector<Hit> hits_;
  std::vector<std::vector<Hit>> moved_;  // with each axis moved by a step
};

struct OptimumFinder::WithoutGhosts {
  WithoutGhosts(const SceneFile& scene, Parallel& parallel)
      : camera(scene, {}, parallel), reference(make_reference(scene, {}, parallel, {}, {})) {}
  Camera camera;
  Reference reference;
};

struct OptimumFinder::SearchCamera {
  Camera& camera;
  const Reference& reference;
};

OptimumFinder::OptimumFinder(const SceneFile& scene, const CaptureSettings& settings, Camera& camera,
                             Parallel& parallel, const Reference& reference)
    : scene_(&scene),
      transport_(settings.transport),
      camera_(&camera),
      parallel_(&parallel),
      reference_(&reference),
      spots_(std::make_unique<Spots>(scene, parallel)) {}

OptimumFinder::SearchCamera OptimumFinder::search_camera() {
  if (transport_ != Transport::ghost) return {*camera_, *reference_};
  if (!without_ghosts_) without_ghosts_ = std::make_unique<WithoutGhosts>(*scene_, *parallel_);
  return {without_ghosts_->camera, without_ghosts_->reference};
}

OptimumFinder::~OptimumFinder() = default;

std::vector<double> OptimumFinder::by_rays(MountedLens& lens) {
  constexpr int kRounds = 8;
  constexpr double kSmall = 1e-5;
  std::vector<double> pose(scene_->axes(), 0.5);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> next = spots_->equations(lens, pose).stepped(pose, 0);
    double largest = 0;
    for (std::size_t i = 0; i < pose.size(); ++i) largest = std::max(largest, std::fabs(next[i] - pose[i]));
    pose = next;
    if (largest < kSmall) break;
  }
  return pose;
}

std::vector<double> OptimumFinder::by_images(MountedLens& lens, std::vector<double> pose, std::uint64_t seed) {
  constexpr int kRounds = 4;
  constexpr int kSamples = 16;
  constexpr double kStep = 2e-3;     // of the travel: a fraction of a pixel
  constexpr double kNothing = 1e-8;  // of MSE: a gain that is not worth another round
  const std::size_t count = scene_->sensor.pixels(), axes = pose.size();
  const SearchCamera search = search_camera();
  std::vector<float> here(count);
  std::vector<std::vector<float>> there(axes, std::vector<float>(count));
  double lowest = search.camera.noise_free_mse(lens, pose, seed, search.reference).mse;
  double damping = 0.01;
  for (int round = 0; round < kRounds; ++round) {
    search.camera.render_noise_free(lens, pose, seed, kSamples, here.data());
    std::vector<double> step(axes);
    for (std::size_t axis = 0; axis < axes; ++axis) {
      std::vector<double> moved = pose;
      step[axis] = pose[axis] < 0.5 ? kStep : -kStep;
      moved[axis] += step[axis];
      search.camera.render_noise_free(lens, moved, seed, kSamples, there[axis].data());
    }
    NormalEquations sums(axes);
    Vector slope(static_cast<int>(axes));
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t axis = 0; axis < axes; ++axis)
        slope[static_cast<int>(axis)] = static_cast<double>(there[axis][i] - here[i]) / step[axis];
      sums.add(slope, static_cast<double>(here[i] - search.reference.mean[i]));
    }
    double gain = 0;
    for (int attempt = 0; attempt < 4 && gain <= 0; ++attempt) {
      const std::vector<double> next = sums.stepped(pose, damping);
      const double mse = search.camera.noise_free_mse(lens, next, seed, search.reference).mse;
      if (mse < lowest) {
        gain = lowest - mse;
        lowest = mse;
        pose = next;
        damping *= 0.2;
      } else {
        damping = std::max(damping * 8, 0.5);
      }
    }
    if (gain < kNothing) break;
  }
  return pose;
}

OwnOptimum OptimumFinder::find(MountedLens& lens, std::uint64_t seed) {
  OwnOptimum best;
  best.true_pose = by_images(lens, by_rays(lens), seed);
  best.error = camera_->noise_free_mse(lens, best.true_pose, seed + 1, *reference_);
  return best;
}

}  // namespace relign::imaging
