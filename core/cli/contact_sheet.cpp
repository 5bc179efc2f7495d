#include "cli/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/files.h"
#include "cli/animation.h"
#include "drawing/png.h"
#include "drawing/raster_canvas.h"

namespace relign::cli {
namespace {

constexpr int kInstances = 10;                        // tiles of a row
constexpr double kNear = 0.1;                         // of the way from the nominal pose to the start
constexpr double kTile = 200, kGap = 4, kTitle = 22;  // pixels

struct Row {
  std::string title;
  std::vector<drawing::Raster> tiles;
};

// The square root of the value brings out stray light; white is at 80 % of the range, so that brighter pixels show.
drawing::Raster tile_of(const images::Image& image, double white) {
  drawing::Raster tile{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  tile.rgb.reserve(3 * image.values.size());
  for (const float value : image.values) {
    const double level = std::sqrt(std::clamp(static_cast<double>(value) / white, 0.0, 1.5625)) * 0.8;
    tile.rgb.insert(tile.rgb.end(), 3, static_cast<std::uint8_t>(std::lround(255 * level)));
  }
  return tile;
}

// Captures `count` instances at `share` of the way from the nominal pose to the start.
void add_captures(Context& context, const ContactSheet& sheet, const LoadedScene& scene, const std::string& scene_id,
                  double share, int count, Row& row) {
  LensChoice choice = sheet.lens;
  for (int i = 0; i < count; ++i, ++choice.instance) {
    const ChosenLens lens = choose_lens(context, choice, scene);
    std::vector<double> pose = scene.facts.nominal_pose;
    for (std::size_t axis = 0; axis < pose.size(); ++axis)
      pose[axis] += share * (lens.instance->perturbations.start[axis] - pose[axis]);
    plugin_host::MountedAssembly assembly = scene.scene->mount(lens.offsets);
    const std::uint64_t seed = sheet.seed + row.tiles.size() + (share < 1 ? 0 : kInstances);
    row.tiles.push_back(tile_of(take_image(assembly, scene.facts, pose, seed, scene_id), scene.facts.image_white));
  }
}

drawing::Raster draw(const std::vector<Row>& rows) {
  const drawing::Raster& first = rows.front().tiles.front();
  const double tile_height = kTile * first.height / first.width;
  drawing::RasterCanvas canvas(kGap + kInstances * (kTile + kGap),
                               static_cast<double>(rows.size()) * (kTitle + tile_height + kGap), 1);
  double y = 0;
  for (const Row& row : rows) {
    canvas.text({kGap, y + kTitle - 7}, row.title, {13, {}, drawing::Anchor::start, false, false});
    y += kTitle;
    double x = kGap;
    for (const drawing::Raster& tile : row.tiles) {
      canvas.picture({x, y, kTile, tile_height}, tile);
      x += kTile + kGap;
    }
    y += tile_height + kGap;
  }
  return canvas.take();
}

}  // namespace

int render_contact_sheet(Context& context, const ContactSheet& sheet, const LoadedScene& scene) {
  std::vector<Row> rows = {{sheet.scene_id + ", random imaging errors, near the optimum", {}},
                           {sheet.scene_id + ", random imaging errors, at the start", {}}};
  add_captures(context, sheet, scene, sheet.scene_id, kNear, kInstances, rows[0]);
  add_captures(context, sheet, scene, sheet.scene_id, 1, kInstances, rows[1]);
  if (!sheet.beside.empty()) {
    const LoadedScene other =
        load_scene(named_choice(context.catalog(), plugin_host::Kind::scene, sheet.beside, "--beside"),
                   context.services(core_count()));
    refuse_station(other, sheet.beside);
    Row& row = rows.emplace_back(Row{sheet.beside + ", the first five near the optimum, then at the start", {}});
    for (const double share : {kNear, 1.0})
      add_captures(context, sheet, other, sheet.beside, share, kInstances / 2, row);
  }
  write_file_atomically(sheet.out, drawing::png_bytes(draw(rows)));
  if (context.json)
    print_result(
        Json({{"sheet", sheet.out}, {"randomised", 2 * kInstances}, {"beside", rows.size() > 2 ? kInstances : 0}})
            .dump(2) +
        "\n");
  else
    print_result(sheet.out + "\n");
  return kDone;
}

}  // namespace relign::cli
