// The camera: images of lenses as built, at any pose.
//
// An image is a pure function of (scene, assembly, pose, seed): bit-equal for any number of threads
// and on any x86-64 with AVX2. Values are irradiance for an emitter of radiance 1.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "imaging/certificate.h"
#include "imaging/diffraction.h"
#include "imaging/ghost_image.h"
#include "imaging/mounted_lens.h"
#include "imaging/pupil_tiles.h"
#include "imaging/scene_file.h"
#include "optics/assembly.h"
#include "optics/block_tracer.h"

namespace relign::imaging {

struct RayPath;
class DiffractedTruth;

enum class Transport {
  refract,  // every face lets all light through
  fresnel,  // unpolarised transmittances of uncoated glass
  ghost     // the same, and what is reflected goes on: ghosts, and light that the sensor scatters
};

enum class Sampler {
  paper,       // the paper's noise, exact in law, tracing only directions that can pass
  hemisphere,  // the paper's noise as its renderer makes it: the cross-check
  pupil        // uniform in B with weights: little noise
};

std::optional<Transport> transport_from_name(const std::string& name);
const char* name_of(Transport transport);
std::optional<Sampler> sampler_from_name(const std::string& name);

struct CaptureSettings {
  Transport transport = Transport::fresnel;
  Sampler sampler = Sampler::paper;
  int samples = 64;  // 1 to kMostSamples directions a pixel: over the hemisphere (paper, hemisphere) or in B (pupil)
  double sensor_albedo = 0;  // transport ghost: share of the light that the sensor scatters, evenly; 0 to 1
};

// Two independent noise-free renders of the reference pose and their mean, O*.
struct Reference {
  std::vector<float> first, second, mean;
};

inline constexpr int kTruthGroups = 4;
inline constexpr int kTruthSamples = 8;
// Transport ghost, besides: paths a pixel that were reflected somewhere. They bring little light, so they are fewer.
inline constexpr int kTruthGhosts = 1;
inline constexpr int kRaysPerGhost = 32;  // of noise-free renders that name no other number

// A noise-free render that goes on until its noise is small enough: means of batches, the noise found from their
// scatter.
struct NoiseFreeRequest {
  std::uint64_t seed = 0;
  double error = 0;  // wanted standard error of a pixel, root mean square over all; not used with `samples`
  long samples = 0;  // over 0: this many rays a pixel (rounded up to whole batches), whatever the error
  int batch = 256;   // rays a pixel of one batch
  int rays_per_ghost = 8;
  int most_batches = 64;
};
struct NoiseFreeResult {
  double standard_error = 0;  // of a pixel, root mean square over all pixels
  long samples = 0;           // rays a pixel that were used
};

struct MseEstimate {
  double mse = 0;  // unbiased, may be negative
  double standard_error = 0;
};

class Camera {
 public:
  // scene, parallel and tracer outlive the camera. The tracer leads rays through the lens in place of its spheres, if
  // there is one; which directions are traced is found from the spheres all the same. One frame at a time, by all
  // threads of `parallel`; for many frames at once see camera_batch.h. Allocates everything it needs; captures allocate
  // nothing from the second on.
  Camera(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel,
         optics::BlockTracer* tracer = nullptr);
  ~Camera();

  // Throws Error(internal) where images of the lens at the pose would miss light: see certificate.h. Returns how many
  // of the rays that were tried reach the target.
  int certify(MountedLens& lens, const std::vector<double>& true_pose, const CertificateRays& rays, std::uint64_t seed);

  // Each writes sensor.pixels() values. Captures are read out by the sensor's electronics, if it has any (read_out.h);
  // noise-free renders and truth are the light itself.
  void capture(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed, float* pixels);
  // Low-discrepancy sampling of B: `samples` rays a pixel, and with transport ghost one path for `rays_per_ghost`.
  void render_noise_free(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed, int samples,
                         float* pixels, int rays_per_ghost = kRaysPerGhost);
  // At least kLeastBatches batches. Allocates.
  NoiseFreeResult render_noise_free(MountedLens& lens, const std::vector<double>& true_pose,
                                    const NoiseFreeRequest& request, float* pixels);
  static constexpr int kLeastBatches = 4;
  // MSE against the reference: mean over pixels of products of independent renders minus independent
  // references. kTruthGroups renders of kTruthSamples rays a pixel each.
  MseEstimate noise_free_mse(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                             const Reference& reference);

  // For tests: the same as capture with another sampler or count.
  void set_capture(Sampler sampler, int samples);

 private:
  struct Workspace;
  struct TileSum {
    double product = 0, variance = 0;
  };
  static void add_truth(const double (&seen)[kTruthGroups], double o1, double o2, TileSum& sum);
  // The lens in place at one wavelength: of the scene's list, or the lens's own.
  struct View {
    View(const SceneFile& scene, Parallel& parallel) : tiles(scene, parallel) {}
    std::size_t which = 0;  // of MountedLens
    double weight = 1;      // of the light
    std::uint32_t streams = 0;
    PupilTiles tiles;
    // of the pose in place
    optics::BackwardPath path;
    std::vector<optics::Op> ops;
  };
  // How many of a pixel's samples are each view's. Fewer samples than views: one each.
  std::vector<int> shared_out(int samples) const;
  const std::vector<Tile>& tiles() const { return views_.front().tiles.tiles(); }  // boxes are the same in all views
  void place(MountedLens& lens, const std::vector<double>& true_pose);
  RayPath way(const View& view) const;
  void catch_light(std::uint64_t seed, float* pixels);
  // Of the lens in place, the light of one group that is reflected nowhere; and with ghosts, by rays alone.
  void render_straight(std::uint64_t seed, std::uint32_t group, int samples, float* pixels);
  void render_rays(std::uint64_t seed, std::uint32_t group, int samples, int ghosts, float* pixels);
  void add_diffraction(float* pixels);
  // Of transport ghost: light at the paper's noise, and what edges, reflections and scattering add to an image that
  // has all other light.
  void play_ghosts(std::uint64_t seed, float* pixels);
  void add_ghosts(std::uint64_t seed, std::uint32_t group, int samples, float* pixels);
  // An image from each view's share of a pixel's samples: body(source, way, tile, samples) sends the rays of a
  // tile and returns what the sum of a pixel's is multiplied with.
  enum class Pixels { that_see, all };
  template <class Body>
  void for_tiles(float* pixels, Pixels which, const std::vector<int>& shares, const Body& body);

  const SceneFile* scene_;
  CaptureSettings settings_;
  Parallel* parallel_;
  optics::BlockTracer* tracer_;
  std::vector<View> views_;  // one a wavelength
  std::vector<int> capture_shares_, truth_shares_;
  // transport ghost
  std::optional<GhostImage> ghosts_;
  std::vector<float> straight_[kTruthGroups];  // images without reflected light
  // of scenes with diffraction
  std::optional<Diffraction> diffraction_;
  Diffraction::Workspace blurring_;
  std::unique_ptr<DiffractedTruth> diffracted_truth_;  // once it was asked for
  optics::EmitterPlane emitter_{};
  std::vector<std::unique_ptr<Workspace>> workspaces_;  // one a thread
  std::vector<TileSum> sums_;                           // one a tile
};

}  // namespace relign::imaging
