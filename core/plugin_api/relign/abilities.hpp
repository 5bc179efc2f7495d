// relign/abilities.hpp: the optional abilities of a scene's assemblies. Comes with relign/plugin.hpp.
// Made by core/plugin_api/generate.py from scene.toml.
// clang-format off
#ifndef RELIGN_ABILITIES_HPP
#define RELIGN_ABILITIES_HPP

#include <cstdint>
#include <optional>
#include <relign/basics.hpp>
#include <vector>

namespace relign {

// Override what the scene offers. Each function returns nothing (false, an empty list) when this assembly does not
// offer it, and is a pure function of its arguments. Poses are true poses. Pixels are whole images,
// memory of the caller.
class Abilities {
 public:
  virtual ~Abilities() = default;

  // A noise-free image, for pictures and reports.
  virtual bool render_noise_free(const Pose& /*pose*/, float* /*pixels*/) {
    return false;
  }

  struct Average {
    double standard_error = 0;  // of a pixel, as root mean square over all pixels
    std::uint64_t samples_used = 0;  // rays (or what the scene averages) per pixel that were used
  };
  // A noise-free image averaged to a stated standard error, for render --noise-free --error. Averages until the
  // standard error of a pixel is at most `error` (positive, in pixel values), or until a bound of the scene's own; if
  // `samples` is above 0, instead that many samples per pixel (rounded up by the scene). What was reached may be more
  // than `error`. Other seeds give independent images. A scene whose render_noise_free is exact does not need it.
  virtual std::optional<Average> render_average(const Pose& /*pose*/, std::uint64_t /*seed*/, double /*error*/,
      std::uint64_t /*samples*/, float* /*pixels*/) {
    return std::nullopt;
  }

  // A noise-free image and its derivatives, for render --derivatives and the service model. The image averages
  // `samples` rays per pixel (or what the scene averages), at least 1; behind it come its derivatives, from the same
  // rays: in the order of the axes, each per whole travel of its axis; then for each of `elements` (numbered from 0 in
  // the order of the description, each at most once) five by its offsets: shift_mm x, y, z (per mm) and tilt_deg x, y
  // (per degree). Other seeds give independent images.
  virtual bool render_slopes(const Pose& /*pose*/, std::uint64_t /*seed*/, std::uint32_t /*samples*/,
      const std::vector<std::uint32_t>& /*elements*/, float* /*pixels*/) {
    return false;
  }

  struct Optimum {
    Pose true_pose;  // with the lowest noise-free MSE that the scene can find
    double mse = 0;  // an unbiased estimate there, in squared pixel values
    double standard_error = 0;  // of that estimate
  };
  // The pose at which a lens as built is best. Results are compared with it ("excess": what an algorithm could still
  // gain). Algorithms never observe it.
  virtual std::optional<Optimum> own_optimum(std::uint64_t /*seed*/) {
    return std::nullopt;
  }

  // A further score at a pose; required of scenes that declare some. `which` numbers those of the description's score
  // ("further") from 0 in its order. Noise-free, from 0, in the unit of the description, the better the lower.
  // Algorithms never observe it. `seed` selects a random stream that no capture uses.
  virtual std::optional<double> further_score(const Pose& /*pose*/, std::uint64_t /*seed*/, std::uint32_t /*which*/) {
    return std::nullopt;
  }

  struct FieldMtf {
    double centre = 0;  // in the middle of that part of the target whose ideal (undistorted) image is on the sensor
    double corner = 0;  // 0.8 of the way from there to each of the part's four corners; the lowest value of the four,
    // because a tilted lens blurs each of them differently
  };
  // MTF at points of the field; required by suites with "spec": {"mtf": ...}. The geometric MTF of the lens itself,
  // from rays: without noise, diffraction, pixels and reflections. Algorithms never observe it. At a point of the field
  // it is that of the light in the plane of the sensor, for lp_per_mm (positive) line pairs per millimetre there, over
  // all wavelengths of the scene; the lower one of sagittal and tangential lines; 0 where no light arrives. Points of
  // the field are places of the target, the same for every lens and pose.
  virtual std::optional<FieldMtf> mtf(const Pose& /*pose*/, double /*lp_per_mm*/) {
    return std::nullopt;
  }

  struct FieldValues {
    double x_px = 0;  // from the centre of the first column
    double y_px = 0;  // from the centre of the top row
    double tangential = 0;
    double sagittal = 0;
  };
  // Where a lens images the fields, and how sharply; required by suites with field_mtf. Places and MTF of fields of the
  // scene's description, numbered by `which` from 0 in its order. Algorithms never observe them. A field's point is a
  // point of the target, the same for every lens and pose: the one that the design images onto the field's mark or,
  // without a mark, onto the middle of its regions. Its place is the centroid of the light of that point in the plane
  // of the sensor. The MTF (tangential, sagittal) is that of the ability "mtf", for line pairs across the field's two
  // edges; without edges on the target, along and across the radius. It is 0, and the place NaN, where no light
  // arrives.
  virtual std::vector<FieldValues> fields(const Pose& /*pose*/, double /*lp_per_mm*/,
      const std::vector<std::uint32_t>& /*which*/) {
    return {};
  }

  // Captures of regions that an algorithm selects. As capture, for the pixels of some regions, at least one, as sensors
  // with regions of interest read them out. A scene without it captures whole frames only. A region has at least one
  // pixel and is inside the image; regions may overlap. Every pixel of the regions is written, the same bits as in the
  // whole capture, into a whole image, in which the host sets the others to 0. share: the pixels that are read out as a
  // share of those of a whole capture, by which "readout_ms" of the description is multiplied.
  virtual std::optional<double> capture_regions(const Pose& /*pose*/, std::uint64_t /*seed*/,
      const std::vector<Region>& /*regions*/, float* /*pixels*/) {
    return std::nullopt;
  }
};

// What the scene says beforehand about its assemblies.
class SceneAbilities {
 public:
  virtual ~SceneAbilities() = default;
  // Whether its assemblies have capture_regions.
  virtual bool captures_regions() const { return false; }
};

}  // namespace relign

#endif  // RELIGN_ABILITIES_HPP
