// The contents of a design program's file as one plain struct for Zemax, CODE V and listings. Surfaces in the file's
// order, lengths in mm, z along the light.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "optics/rigid.h"

namespace relign::lens_files {

// From here on values mean a plane or an object at infinity: design programs write 1e10, 1e13 or INFINITY.
constexpr double kInfinite = 1e10;
constexpr std::size_t kMaxSurfaces = 1000;
constexpr std::size_t kMaxBytes = 16 << 20;
constexpr int kHighestPower = 32;  // of an asphere's polynomial
constexpr int kMaxQTerms = 30;

// Terms of Forbes's orthogonal polynomials, Q_bfs or Q_con; coefficients in mm.
struct QAsphere {
  double radius_mm = 0;  // at which u is 1
  std::vector<double> coefficients;
};

struct Surface {
  int line = 0;       // where its description begins
  std::string label;  // the file's own: "3", "STO", "OBJ"
  double curvature = 0;
  double conic = 0;
  std::vector<double> even_asphere;  // of r^2, r^4, r^6 ...; 1/mm^(2i-1)
  std::vector<double> odd_asphere;   // of r^3, r^5, r^7 ...
  std::optional<QAsphere> q_bfs, q_con;
  double thickness_mm = 0;
  std::string glass;  // empty: air. The name or code as the file has it
  int glass_line = 0;
  double stated_nd = 0, stated_vd = 0;  // beside a glass's name in the file; 0: none
  double nd = 0, vd = 0;                // of a model glass, which has no name; vd 0: no dispersion
  double index = 0;                     // at the reference wavelength; 0: not stated
  double clear_radius_mm = 0;           // 0: not stated
  bool stop = false;
  bool mirror = false;      // light stays in the medium in front of it
  bool break_only = false;  // a coordinate break without a face
  // Frame of this surface relative to the previous one, and of the next relative to this one.
  std::optional<optics::Motion> before, after;
};

struct SystemAperture {
  enum Kind { none, entrance_pupil_diameter, f_number, object_na, image_na, stop_size };
  Kind kind = none;
  double value = 0;  // above 0; 0 for stop_size
  int line = 0;
  std::string word;  // keyword in the file: "ENPD"
};

struct FieldSize {
  // An image height is paraxial, or the real chief ray's.
  enum Kind { none, angle_deg, object_height_mm, image_height_mm, real_image_height_mm };
  Kind kind = none;
  double value = 0;  // the largest
  int line = 0;
};

// One field of the design, and the fractions of the entrance pupil's radius that vignetting cuts from its beam: 0 none,
// 1 up to the centre. Below, above, left and right as seen from the object.
struct FieldBeam {
  double x = 0, y = 0;  // as fractions of the largest field
  double cut_below = 0, cut_above = 0, cut_left = 0, cut_right = 0;
  bool is_cut() const { return cut_below != 0 || cut_above != 0 || cut_left != 0 || cut_right != 0; }
};

// A note about something in the file that was not used or was assumed; similar ones are merged.
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
  std::vector<double> all_wavelengths_nm;  // of the design
  std::vector<double> wavelength_weights;  // one each; 1 if not stated
  int wavelengths_line = 0;
  std::map<std::string, double> published;  // first-order values, by the names of lens.json
  std::vector<Remark> remarks;
  std::vector<Problem> problems;  // reasons to reject the file, reported together with those of its glasses

  // From the object to the first vertex, mm; negative for a virtual object, empty for one at infinity.
  std::optional<double> object_distance_mm() const;
  // The same for beam(): 0 if the object is at infinity or virtual.
  double beam_distance_mm() const;
};

constexpr const char* kVignettingRemark =
    "vignetting factors are used only for semi-diameters that the file does not state; in images the semi-diameters "
    "determine vignetting";

// Collects the design, remarks and problems while a reader processes lines.
class Reading {
 public:
  Reading(const std::string& file, const std::string& format);

  LensDesign design;

  // Merges remarks with the same key.
  void remark(int line, const std::string& key, const std::string& text);
  void not_understood(int line, const std::string& keyword, const std::string& text);
  void problem(int line, const std::string& message);
  // The number in a word; adds a problem and returns 0 if it is not a number within +-limit.
  double number(int line, const std::string& word, const std::string& what, double limit = 1e30);
  int integer(int line, const std::string& word, const std::string& what);
  // Sets the system aperture; adds a problem if it is 0 or less. The last one applies, earlier ones get a remark.
  void aperture(int line, const std::string& keyword, SystemAperture::Kind kind, const std::string& value);
  // Appends a surface; throws all problems if there are too many.
  Surface& add_surface(int line, const std::string& label);

  // The design with every problem.
  LensDesign finish();

 private:
  std::map<std::string, std::size_t> remark_of_key_;
  std::vector<Problem> problems_;
  std::size_t omitted_problems_ = 0;
};

// Millimetres per unit: MM, CM, IN, INCH, INCHES, M and METER; empty for others.
std::optional<double> millimetres(const std::string& unit);
// Sets the coefficient of r^power, power from 2 up.
void set_term(Surface& surface, int power, double coefficient);
// Multiplies every length.
void scale(LensDesign& design, double factor);

// Decentres (in the design's unit) and tilts in degrees as one motion. `tilt_first`: tilts in reverse order, then the
// decentre along the tilted axes.
optics::Motion coordinate_break(const optics::Vec3& shift, double rx_deg, double ry_deg, double rz_deg,
                                bool tilt_first = false);

}  // namespace relign::lens_files
