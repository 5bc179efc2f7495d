// Mesh scenes through the plugin interface, compared with analytic ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "base/error.h"
#include "base/files.h"
#include "base/json_source.h"
#include "imaging/camera.h"
#include "imaging/scene_file.h"
#include "meshes/lens_meshes.h"
#include "meshes/mesh_file.h"
#include "meshes/mesh_writer.h"
#include "optics/prescription.h"
#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"

namespace relign::plugin_host {
namespace {

using testing::HasSubstr;

const std::vector<double> kPose = {0.52, 0.49, 0.55, 0.5, 0.47};
constexpr char kOffsets[] = R"({"L3": {"tilt_deg": [0.4, -0.3]}, "L4": {"shift_mm": [0, 0.01, 0]}})";

class LensMeshTest : public testing::Test {
 protected:
  LensMeshTest() : folder_(std::filesystem::temp_directory_path() / ("relign-lens-mesh-" + std::to_string(getpid()))) {
    for (const char* name : {"lens_mesh", "lens_system"}) catalog_.add(std::string(RELIGN_PLUGIN_DIR) + "/" + name);
    std::filesystem::create_directories(folder_);
  }
  ~LensMeshTest() override { std::filesystem::remove_all(folder_); }

  Scene scene(const std::string& id, Json given, unsigned threads = 2) {
    given["pixels"] = 50;
    HostServices services;
    services.threads = threads;
    return Scene(catalog_.resolve_or_throw(Kind::scene, id, given), services);
  }
  std::string failure(const Json& given) {
    try {
      scene("relign_od_mesh", given);
    } catch (const Error& error) {
      return error.what();
    }
    return "no failure";
  }
  void write_meshes(double pitch_mm) {
    for (const optics::Element& element : lens().elements)
      write_file_atomically(folder_ / (element.name + ".ply"), meshes::ply_of(meshes::element_mesh(element, pitch_mm)));
  }
  static const optics::Prescription& lens() {
    static const optics::Prescription kLens =
        optics::read_prescription(std::string(RELIGN_PLUGIN_DIR) + "/lens_mesh/relign_od/lens.json");
    return kLens;
  }
  static std::vector<float> noise_free(Scene& of) {
    MountedAssembly assembly = of.mount(kOffsets);
    std::vector<float> pixels(2500);
    EXPECT_TRUE(assembly.render_noise_free(kPose, pixels.data()));
    return pixels;
  }
  static double rms_difference(const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(static_cast<double>(a[i] - b[i]), 2);
    return std::sqrt(sum / static_cast<double>(a.size()));
  }

  const std::filesystem::path folder_;
  Catalog catalog_;
};

TEST_F(LensMeshTest, HasNoMtf) { EXPECT_FALSE(scene("relign_od_mesh", {}).mount("{}").mtf(kPose, 10)); }

// Both scenes trace the same rays. The error of a ray falls with the square of the pitch (mesh_lens_meshes), and so
// does the difference between images, down to rounding to float.
TEST_F(LensMeshTest, ImagesConvergeWithThePitch) {
  imaging::SceneChoices choices;
  choices.pixels = 50;
  const imaging::SceneFile file =
      imaging::read_scene_file(std::string(RELIGN_PLUGIN_DIR) + "/lens_mesh/relign_od/scene.json", choices);
  Parallel parallel(2);
  const auto offsets = optics::read_offsets(JsonSource::from_text(kOffsets, "offsets"), "", file.lens);
  const auto render = [&](optics::BlockTracer* tracer) {
    imaging::Camera camera(file, {}, parallel, tracer);
    imaging::MountedLens lens(file, optics::Assembly(file.lens, offsets));
    std::vector<float> pixels(2500);
    camera.render_noise_free(lens, kPose, 1, 64, pixels.data());
    return pixels;
  };
  const std::vector<float> exact = render(nullptr);
  std::vector<double> shares;
  for (const double pitch_mm : {0.4, 0.1}) {
    std::map<std::string, meshes::Mesh> meshes;
    for (const optics::Element& element : file.lens.elements)
      meshes[element.name] = meshes::element_mesh(element, pitch_mm);
    meshes::LensMeshes tracer(file.lens, meshes);
    const std::vector<float> found = render(&tracer);
    double difference = 0, light = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      difference += std::fabs(static_cast<double>(found[i] - exact[i]));
      light += static_cast<double>(exact[i]);
    }
    shares.push_back(difference / light);
  }
  EXPECT_LT(shares[1], 0.001);
  EXPECT_GT(shares[0] / shares[1], 10) << "16 without rounding to float";
}

TEST_F(LensMeshTest, NoiseFreeMseMatchesAnalyticLens) {
  Scene spheres = scene("relign_od", Json::object()), meshes = scene("relign_od_mesh", Json::object());
  MountedAssembly of_meshes = meshes.mount(kOffsets), of_spheres = spheres.mount(kOffsets);
  const auto found = of_meshes.noise_free_mse(kPose, 5), expected = of_spheres.noise_free_mse(kPose, 6);
  EXPECT_NEAR(found.mse, expected.mse, 4 * (found.standard_error + expected.standard_error) + 2e-6);
}

TEST_F(LensMeshTest, EverySamplerHasTheSameMean) {
  double means[3] = {0, 0, 0};
  const char* const names[3] = {"paper", "hemisphere", "pupil"};
  for (int i = 0; i < 3; ++i) {
    Scene of = scene("relign_od_mesh", {{"sampler", names[i]}, {"pitch_mm", 0.3}});
    MountedAssembly assembly = of.mount("{}");
    std::vector<float> pixels(2500);
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      assembly.capture({0.5, 0.5, 0.5, 0.5, 0.5}, seed, pixels.data());
      for (const float pixel : pixels) means[i] += static_cast<double>(pixel) / 10000;
    }
  }
  // A ray has weight 0.0603: the mean of 10,000 pixels of mean 0.018 has standard deviation
  // sqrt(0.0603 x 0.018 / 10000) = 0.0003.
  EXPECT_NEAR(means[0], means[2], 0.0013);
  EXPECT_NEAR(means[1], means[2], 0.0015) << "sampler hemisphere includes light through edges";
  EXPECT_NEAR(means[2], 0.0181, 0.0006) << "value of the analytic lens";
}

TEST_F(LensMeshTest, ImagesDoNotDependOnThreads) {
  std::vector<float> first(2500), second(2500);
  for (const unsigned threads : {1U, 3U}) {
    Scene of = scene("relign_od_mesh", {{"pitch_mm", 0.3}}, threads);
    MountedAssembly assembly = of.mount(kOffsets);
    assembly.capture(kPose, 7, (threads == 1 ? first : second).data());
  }
  EXPECT_EQ(first, second);
}

TEST_F(LensMeshTest, MeshFilesMatchMeshesFromLensFile) {
  write_meshes(0.3);
  Scene made = scene("relign_od_mesh", {{"pitch_mm", 0.3}});
  Scene read = scene("relign_od_mesh", {{"meshes", folder_.string()}});
  EXPECT_LT(rms_difference(noise_free(made), noise_free(read)), 1e-4) << "files hold floats";
  EXPECT_EQ(Json::parse(read.describe()).at("files").size(), 6u) << "scene, lens, four meshes";

  std::filesystem::rename(folder_ / "L2.ply", folder_ / "second lens.PLY");
  EXPECT_THAT(failure({{"meshes", folder_.string()}}),
              HasSubstr("must be L2.ply, L2.stl or L2.obj, or named by parameter 'names'"));
  Scene named = scene("relign_od_mesh", {{"meshes", folder_.string()}, {"names", "L2 = second lens.PLY"}});
  EXPECT_EQ(noise_free(named), noise_free(read));
}

TEST_F(LensMeshTest, ReadsMeshesNamedInSceneFile) {
  write_meshes(0.3);
  std::filesystem::rename(folder_ / "L1.ply", folder_ / "lens_0.PLY");
  const std::string data = std::string(RELIGN_PLUGIN_DIR) + "/lens_mesh/relign_od/";
  Json document = Json::parse(read_file(data + "scene.json"));
  document["use"] = "lens_mesh";
  document["lens"] = data + "lens.json";
  document["meshes"] = {{"folder", "."}, {"files", {{"L1", "lens_0.PLY"}}}};
  const std::filesystem::path file = folder_ / "scene.json";
  write_file_atomically(file, document.dump());
  Scene read = scene(file.string(), Json::object());
  EXPECT_EQ(Json::parse(read.describe()).at("files").at(2), (folder_ / "." / "lens_0.PLY").string());

  document["meshes"] = {{"folders", "."}, {"files", {{"L1", 5}}}};
  write_file_atomically(file, document.dump());
  try {
    scene(file.string(), Json::object());
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/meshes: missing key 'folder'"));
    EXPECT_THAT(error.what(), HasSubstr("/meshes/files/L1: expected"));
    EXPECT_THAT(error.what(), HasSubstr("unknown key 'folders'"));
  }
}

TEST_F(LensMeshTest, ErrorsNameTheBadInput) {
  EXPECT_THAT(failure({{"meshes", "/no/such/folder"}}), HasSubstr("'/no/such/folder' is not a folder"));
  EXPECT_THAT(failure({{"names", "L1=a.ply"}}), HasSubstr("'names' needs the folder of the files"));
  write_meshes(0.5);
  const auto with_names = [&](const char* names) { return failure({{"meshes", folder_.string()}, {"names", names}}); };
  EXPECT_THAT(with_names("L1"), HasSubstr("found 'L1', must be NAME=FILE"));
  EXPECT_THAT(with_names("L1=L1.ply,L1=L2.ply"), HasSubstr("duplicate file for 'L1'"));
  EXPECT_THAT(with_names("apertur stop=L1.ply"), HasSubstr("did you mean 'aperture stop'?"));
  EXPECT_THAT(with_names("L1=none.ply"), HasSubstr("none.ply"));
  const std::string whole = read_file(folder_ / "L3.ply");
  write_file_atomically(folder_ / "L3.ply", whole.substr(0, whole.size() / 2));
  EXPECT_THAT(failure({{"meshes", folder_.string()}}), HasSubstr("L3.ply: the file is truncated"));
  EXPECT_THAT(failure({{"pitch_mm", 5}}), HasSubstr("pitch_mm"));
}

}  // namespace
}  // namespace relign::plugin_host
