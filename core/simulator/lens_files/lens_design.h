// A lens as a design program's file tells it, before anything is made of it: one plain struct for Zemax, CODE V
// and listings. Surfaces in the file's order, lengths in mm, z along the light.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "optics/rigid.h"

namespace relign::lens_files {

// Larger values mean a plane or an object at infinity: design programs write 1e10, 1e13 or INFINITY.
constexpr double kInfinite = 1e10;
constexpr std::size_t kMostSurfaces = 1000;
constexpr std::size_t kMostBytes = 16 << 20;
constexpr int kHighestPower = 32;  // of an asphere's polynomial
constexpr int kMostQTerms = 30;

// Terms of Forbes' orthogonal polynomials, Q_bfs or Q_con; coefficients are lengths.
struct QAsphere {
  double radius_mm = 0;  // at which u is 1
  std::vector<double> coefficients;
};

struct Surface {
  int line = 0;       // where its description begins
  std::string label;  // as the file counts: "3", "STO", "OBJ"
  double curvature = 0;
  double conic = 0;
  std::vector<double> even_asphere;  // of r^2, r^4, r^6 ...; 1/mm^(2i-1)
  std::vector<double> odd_asphere;   // of r^3, r^5, r^7 ...
  std::optional<QAsphere> q_bfs, q_con;
  double thickness_mm = 0;
  std::string glass;  // empty: air. The name or code as the file has it
  int glass_line = 0;
  double stated_nd = 0, stated_vd = 0;  // beside a glass's name in the file; 0: none
  double nd = 0, vd = 0;                // of a model glass, which has no other name; vd 0: no dispersion
  double index = 0;                     // told by the file for the reference wavelength; 0: not told
  double clear_radius_mm = 0;           // 0: not told
  bool stop = false;
  bool mirror = false;      // light stays in the medium before it
  bool break_only = false;  // a coordinate break without a face
  // The frame of this surface in the one before, and the frame of the next in this one.
  std::optional<optics::Motion> before, after;
};

struct SystemAperture {
  enum Kind { none, entrance_pupil_diameter, f_number, object_na, image_na, stop_size };
  Kind kind = none;
  double value = 0;  // above 0; 0 for stop_size
  int line = 0;
  std::string word;  // what the file calls it: "ENPD"
};

struct FieldSize {
  // An image height is paraxial, or where the real chief ray meets the image.
  enum Kind { none, angle_deg, object_height_mm, image_height_mm, real_image_height_mm };
  Kind kind = none;
  double value = 0;  // the largest
  int line = 0;
};

// One field of the design, and the parts of the entrance pupil's radius that vignetting takes from its beam: 0 nothing,
// 1 up to the centre. Below and above, left and right as seen from the object.
struct FieldBeam {
  double x = 0, y = 0;  // as parts of the largest field
  double cut_below = 0, cut_above = 0, cut_left = 0, cut_right = 0;
  bool is_cut() const { return cut_below != 0 || cut_above != 0 || cut_left != 0 || cut_right != 0; }
};

// Something in the file that was not used; several alike are one.
struct Remark {
  int line = 0;
  std::string text;
  int more_lines = 0;
};

struct LensDesign {
  std::string file;
  std::string format;  // "Zemax", "CODE V", "CODE V listing"
  std::string title;
  std::vector<Surface> surfaces;  // the object's first, the image's last
  double first_vertex_mm = 0;     // of the first face of glass or mirror, behind surface 1; draft_lens() finds it
  SystemAperture aperture;
  FieldSize field;
  std::vector<FieldBeam> fields;
  double wavelength_nm = 0;                // the reference wavelength
  std::vector<double> all_wavelengths_nm;  // those that the design is for
  std::vector<double> wavelength_weights;  // of each of them; 1 where the file does not state it
  int wavelengths_line = 0;
  std::map<std::string, double> published;  // first-order values, by the names of lens.json
  std::vector<Remark> remarks;
  std::vector<Problem> problems;  // for which the file is refused, once its surfaces and glasses are looked at too

  // From the object to the first vertex, mm; negative for a virtual object, nothing for one that is infinitely far.
  std::optional<double> object_distance_mm() const;
  // The same as beam() takes it: 0 where the object is infinitely far or virtual.
  double beam_distance_mm() const;
};

constexpr const char* kVignettingRemark =
    "vignetting factors are used only for clear radii that the file does not state; images have the light that clear "
    "radii let through";

// What every reader collects while it goes through the lines.
class Reading {
 public:
  Reading(const std::string& file, const std::string& format);

  LensDesign design;

  // Remarks with the same key become one.
  void remark(int line, const std::string& key, const std::string& text);
  void not_understood(int line, const std::string& keyword, const std::string& text);
  void problem(int line, const std::string& message);
  // The number in a word; a problem and 0 when it is none, or beyond +-limit.
  double number(int line, const std::string& word, const std::string& what, double limit = 1e30);
  int integer(int line, const std::string& word, const std::string& what);
  // The system aperture as the file states it; a problem when it is 0 or less. The last one counts, others are listed.
  void aperture(int line, const std::string& keyword, SystemAperture::Kind kind, const std::string& value);
  // A new surface at the end; throws all problems at once when there are too many.
  Surface& add_surface(int line, const std::string& label);

  // The design with every problem.
  LensDesign finish();

 private:
  std::map<std::string, std::size_t> remark_of_key_;
  std::vector<Problem> problems_;
  std::size_t untold_problems_ = 0;
};

// A millimetre's multiple by its name: MM, CM, IN, M and METER. Nothing for others.
std::optional<double> millimetres(const std::string& unit);
// The coefficient of r^power, power from 2 up.
void set_term(Surface& surface, int power, double coefficient);
// Multiplies every length.
void scale(LensDesign& design, double factor);

// Decentres (in the design's unit) and tilts in degrees as one motion. `tilt_first`: tilts in reverse order, then
// the decentre along the tilted axes.
optics::Motion coordinate_break(const optics::Vec3& shift, double rx_deg, double ry_deg, double rz_deg,
                                bool tilt_first = false);

}  // namespace relign::lens_files
