// The camera: images of lenses as built, at any pose.
//
// An image is a pure function of (scene, assembly, pose, seed): bit-equal for any number of threads
// and on any x86-64 with AVX2. Values are irradiance for an emitter of radiance 1.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "base/pixel_region.h"
#include "imaging/certificate.h"
#include "imaging/diffraction.h"
#include "imaging/ghost_image.h"
#include "imaging/mounted_lens.h"
#include "imaging/mse_pixel.h"
#include "imaging/pupil_tiles.h"
#include "imaging/ray_derivatives.h"
#include "imaging/scene_file.h"
#include "optics/assembly.h"
#include "optics/block_tracer.h"

namespace relign::imaging {

struct RayPath;
class RaySource;
class DiffractedMse;

enum class Transport {
  refract,  // every face transmits all light
  fresnel,  // unpolarised transmittances of uncoated glass
  ghost     // fresnel plus stray light: ghosts (reflections) and sensor scatter
};

enum class Sampler {
  paper,       // the paper's noise, same distribution, tracing only the importance region
  hemisphere,  // the paper's noise as its renderer generates it: the cross-check
  pupil,       // independent directions in the importance region, weighted: less noise
  lattice      // the same with a lattice of places and directions for each pixel, shifted at random: least noise
};

std::optional<Transport> transport_from_name(const std::string& name);
const char* name_of(Transport transport);
std::optional<Sampler> sampler_from_name(const std::string& name);

struct CaptureSettings {
  Transport transport = Transport::fresnel;
  Sampler sampler = Sampler::paper;
  int samples =
      64;  // 1 to kMaxSamples directions per pixel: over the hemisphere, or the importance region (pupil, lattice)
  double sensor_albedo = 0;  // transport ghost: share of light scattered by the sensor, Lambertian; 0 to 1
  // noise_free_mse renders one tile in so many, at random, the same ones always; not with ghosts or diffraction.
  int scored_tiles = 1;
};

// Two independent noise-free renders of the reference pose and their mean, O*.
struct Reference {
  std::vector<float> first, second, mean;
};

inline constexpr int kMseSamples = 8;
// The noise of an MSE is that of its rays over all pixels: sensors that read out more pixels than this get fewer each.
inline constexpr double kMsePixels = 80'000;
int mse_samples(double pixels_read_out);
// Transport ghost: additional reflected paths per pixel. They carry little light, so there are fewer of them.
inline constexpr int kMseGhosts = 1;
inline constexpr int kRaysPerGhost = 32;  // default of noise-free renders

// A noise-free render that adds batches until its noise, estimated from their scatter, is small enough.
struct NoiseFreeRequest {
  std::uint64_t seed = 0;
  double error = 0;  // wanted standard error of a pixel, RMS over all pixels; not used with `samples`
  long samples = 0;  // above 0: this many rays per pixel (rounded up to whole batches), whatever the error
  int batch = 256;   // rays per pixel of one batch
  int rays_per_ghost = 8;
  int most_batches = 64;
};
struct NoiseFreeResult {
  double standard_error = 0;  // of a pixel, RMS over all pixels
  long samples = 0;           // rays per pixel used
};

struct MseEstimate {
  double mse = 0;  // unbiased, may be negative
  double standard_error = 0;
};
// How an MSE changes with a rigid motion of the lens, its shift (mm) and turn (rad) about its origin, in lens
// coordinates. Unbiased: each term is a product of independent renders.
struct MseSlopes {
  std::array<double, 6> gradient{};
  std::array<double, 36> gauss_newton{};  // 2 J^T J / pixels: the second derivatives where residuals vanish; symmetric
};
// Of the sum over so many pixels.
MseEstimate estimate_of(const MseSum& sum, double pixels);

class Camera {
 public:
  // scene, parallel and tracer must outlive the camera. A tracer, if given, traces rays in place of the prescription's
  // faces; importance regions come from the prescription in any case. Renders one frame at a time with all threads of
  // `parallel`; for many frames at once see camera_batch.h. Captures do not allocate from the second on.
  Camera(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel,
         optics::BlockTracer* tracer = nullptr);
  ~Camera();

  // Throws Error(internal) if images of the lens at this pose would miss light: see certificate.h. Returns how many of
  // the test rays reach the target.
  int certify(MountedLens& lens, const std::vector<double>& true_pose, const CertificateRays& rays, std::uint64_t seed);

  // Each writes sensor.pixels() values. Captures include the sensor's electronics, if it has any (read_out.h);
  // noise-free renders and MSE are of the irradiance itself. into_print: the print of the target that the capture sees
  // is not where the emitter is: from the world to the emitter's coordinates, a similarity in its plane (not with a
  // tracer).
  void capture(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed, float* pixels,
               const std::optional<optics::Motion>& into_print = std::nullopt);
  // Of these regions only: writes at least their pixels, with the bits of `capture`. Returns the share of the pixels of
  // a whole capture that is read out. Not with diffraction or transport ghost, where a pixel depends on others.
  double capture_regions(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                         const PixelRegions& regions, float* pixels);
  bool captures_regions() const { return !diffraction_ && !ghosts_; }
  // Low-discrepancy sampling of the importance region: `samples` rays per pixel, and with transport ghost one reflected
  // path per `rays_per_ghost` rays.
  void render_noise_free(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed, int samples,
                         float* pixels, int rays_per_ghost = kRaysPerGhost);
  // At least kMinBatches batches. Allocates.
  NoiseFreeResult render_noise_free(MountedLens& lens, const std::vector<double>& true_pose,
                                    const NoiseFreeRequest& request, float* pixels);
  static constexpr int kMinBatches = 4;
  // MSE against the reference: mean over pixels of products of independent renders minus independent references.
  // kMseGroups renders of kMseSamples rays per pixel each, or fewer on sensors of more than kMsePixels. With
  // settings.scored_tiles above 1 it is estimated from these tiles, with the standard error of their MSE.
  MseEstimate noise_free_mse(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                             const Reference& reference);

  // Light and its derivatives by rigid motions of the lens and of elements; without diffraction, electronics and
  // reflected light, and not for a lens of meshes. samples: low-discrepancy rays per pixel, as render_noise_free()
  // takes them; 0: the rays of a capture, with its bits. derivatives: for each pixel of the frame and each part 6
  // numbers, of its shift along x, y, z (per mm) and turn about x, y, z through the lens's origin (per rad), lens
  // coordinates; pixels that are not read out have 0. Throws Error(bad_input) where they are not supported.
  void render_derivatives(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                          std::uint32_t group, int samples, const MovingParts& parts, float* pixels,
                          float* derivatives);

  // What images have that have no derivatives; null if they have.
  const char* without_derivatives() const;
  // The MSE with its slopes: the bits of noise_free_mse(), whose first two renders are differentiated. Not with
  // diffraction, reflected light or a lens of meshes: throws Error(bad_input).
  MseEstimate noise_free_mse(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                             const Reference& reference, MseSlopes& slopes);

  // The pixels that are read out, and their share of all.
  const std::vector<PixelSpan>& spans() const { return spans_; }
  double share_read_out() const;

  // For tests: changes sampler and sample count of capture().
  void set_capture(Sampler sampler, int samples);

 private:
  struct Workspace;
  // The current lens at one wavelength: one of the scene's list, or the lens's own.
  struct View {
    View(const SceneFile& scene, Parallel& parallel) : tiles(scene, parallel) {}
    std::size_t which = 0;  // of MountedLens
    double weight = 1;      // of the light
    std::uint32_t streams = 0;
    PupilTiles tiles;
    // of the current pose
    optics::BackwardPath path;
    std::vector<optics::Op> ops;
    PartReadings readings;
  };
  // How many of a pixel's samples each view gets; at least one.
  std::vector<int> allocate_samples(int samples) const;
  const std::vector<Tile>& tiles() const { return views_.front().tiles.tiles(); }  // boxes are the same in all views
  void place(MountedLens& lens, const std::vector<double>& true_pose,
             const std::optional<optics::Motion>& into_print = std::nullopt, const PixelRegions& regions = {});
  RayPath ray_path(const View& view) const;
  void render_light(std::uint64_t seed, float* pixels);
  // The rays of a tile's pixels, as render_tiles() takes them. Returns the factor for the sums of their light.
  double draw_rays(RaySource& source, const View& view, const Tile& tile, std::uint64_t seed, std::uint32_t group,
                   int samples, int share) const;
  // Light of one group through the current lens, without diffraction.
  void render_rays(std::uint64_t seed, std::uint32_t group, int samples, int ghosts, float* pixels);
  void add_diffraction(float* pixels);
  // Of a placed lens without diffraction. slopes: null if not wanted.
  MseEstimate score_tiles(std::uint64_t seed, const Reference& reference, MseSlopes* slopes);
  MseSum score_tile(std::size_t tile, std::uint64_t seed, const Reference& reference, Workspace& work,
                    MseSlopes* slopes);
  // The light of a tile's pixels in each of the groups, and its derivatives in the first two.
  void render_groups(std::size_t tile, std::uint64_t seed, Workspace& work, bool slopes);
  void require_derivatives() const;
  void place_for_derivatives(MountedLens& lens, const std::vector<double>& true_pose, const MovingParts& parts);
  // Transport ghost: a capture with the paper's noise; and the light that edges, reflections and sensor scatter add to
  // an image without them.
  void capture_ghosts(std::uint64_t seed, float* pixels);
  void add_ghosts(std::uint64_t seed, std::uint32_t group, int samples, float* pixels);
  void choose_scored_tiles();
  void read_out_spans(const std::vector<PixelSpan>& spans, std::uint64_t seed, float* pixels);
  // Straight light, from each view's share of a pixel's samples: of a noise-free render, or with samples 0 of a
  // capture. derivatives: added to, as render_derivatives() has them, if not null.
  void render_tiles(std::uint64_t seed, std::uint32_t group, int samples, float* pixels, float* derivatives = nullptr);

  const SceneFile* scene_;
  CaptureSettings settings_;
  Parallel* parallel_;
  optics::BlockTracer* tracer_;
  std::vector<View> views_;       // one per wavelength
  std::vector<PixelSpan> spans_;  // what the electronics read out
  std::vector<int> capture_shares_, mse_shares_;
  int mse_samples_ = kMseSamples;
  // transport ghost
  std::optional<GhostImage> ghosts_;
  std::vector<float> straight_;                 // an image without reflected light
  std::vector<float> with_ghosts_[kMseGroups];  // images of the noise-free MSE
  // of scenes with diffraction
  std::optional<Diffraction> diffraction_;
  Diffraction::Workspace blurring_;
  std::unique_ptr<DiffractedMse> diffracted_mse_;  // made on first use
  optics::EmitterPlane emitter_{};
  std::vector<std::unique_ptr<Workspace>> workspaces_;  // one per thread
  std::vector<int> scored_;                             // tiles that noise_free_mse renders
  double pixels_per_scored_ = 1;                        // read out, over those in scored tiles
  std::vector<MseSum> sums_;                            // one per scored tile
  std::vector<MseSlopes> tile_slopes_;                  // likewise
};

}  // namespace relign::imaging
