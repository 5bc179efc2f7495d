// Scene files: lens, sensor, emitter and travel of one set-up, as JSON with units in the names.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/schema.h"
#include "images/edge_fields.h"
#include "images/image.h"
#include "imaging/sensor.h"
#include "optics/prescription.h"
#include "optics/pupil_search.h"
#include "optics/ray_block.h"
#include "optics/rigid.h"

namespace relign::imaging {

struct Emitter {
  double z_mm = 0;         // world, negative
  double side_mm = 0;      // square
  std::string target;      // a name or the path of an image, see target.h
  images::Image radiance;  // square, 0 to 1; change it through show() only
  bool repeats = false;    // periodic bitmap, see radiance_at(); set before show()
  // The same for look-ups, see optics::EmitterPlane: 8 bits if lossless, else 16.
  std::vector<std::uint16_t> texels_8_bit;
  std::vector<std::uint32_t> texels_16_bit;

  void show(images::Image image);
  // The plane as block kernels take it; a view of this.
  optics::EmitterPlane plane() const;
  // Radiance at a point of its plane (mm): bilinear between texel centres, 0 outside the square. In the half texel at
  // the border the outermost texel is repeated or, if the bitmap repeats, blended with that of the opposite border, as
  // in renderers with periodic textures. The same as in the block kernels, for single rays.
  double radiance_at(double x_mm, double y_mm) const;
};

// Pose s in [0, 1] per axis; physical value = (2 s - 1) * half travel.
struct Travel {
  std::array<double, 3> shift_mm{};
  std::vector<double> tilt_deg;  // Rx, Ry, optionally Rz
};

// The scene's lens at one of several wavelengths: the same geometry, other indices.
struct SceneWavelength {
  double weight = 0;  // normalised: the sum over all is 1
  optics::Prescription lens;
  std::shared_ptr<const optics::PupilSearch> pupil;  // as SceneFile's
};

struct SceneFile {
  std::string name;
  std::string summary;
  optics::Prescription lens;  // at its own wavelength, or the only one of "wavelengths"
  // Images and MTF are weighted sums over these, 2 to 24; empty: only `lens`. Field points, the coarse
  // optimum and first-order data use `lens`.
  std::vector<SceneWavelength> wavelengths;
  double pivot_behind_first_vertex_mm = 0;  // world origin, on the axis
  Sensor sensor;
  Emitter emitter;
  Travel travel;
  double ambient_index = 1;  // as chosen; divides wavelengths
  Json machine_time;         // as written, null if absent
  Json spec;
  images::EdgeFields fields;                 // as listed; empty where the chosen target or pixels are not the file's
  bool diffraction = false;                  // in images: diffraction.h
  bool diffraction_in_mtf = false;           // "diffraction" of the spec's "mtf": field_mtf.h
  Json meshes;                               // for scenes of meshes; as written, null if absent
  std::vector<std::filesystem::path> files;  // all files that were read
  // Pupil search of this lens, sensor and travel. Reset it after changing them; mounted lenses then search again.
  std::shared_ptr<const optics::PupilSearch> pupil;

  std::size_t axes() const { return 3 + travel.tilt_deg.size(); }
  // Lens coordinates to world coordinates at a true pose (axes() values):
  // p_world = R (p_lens - pivot) + t, R = Rx Ry (Rz), right-handed.
  optics::Motion lens_to_world(const std::vector<double>& true_pose) const;
};

struct SceneChoices {
  double ambient_index = 1;  // divides the glass indices of the file
  std::string target;        // empty: the scene file's; a name or a path, see target.h
  bool rotation_z = false;   // switches the sixth axis on
  int pixels = 0;            // columns, rows in proportion, over the same area; 0: the scene file's
  double warp_um = 0;        // of the sensor, see read_sensor
};

const Schema& scene_schema();  // docs/schemas/scene.schema.json

// Throws Error(bad_input or io) that lists every mistake with its position.
SceneFile read_scene_file(const std::filesystem::path& file, const SceneChoices& choices);

}  // namespace relign::imaging
