// An evaluation folder of a stranger: evaluation.json and submission.json, parted by a line "----".
#include "leaderboard/evaluation.h"
#include "target.h"

using namespace relign;
namespace fs = std::filesystem;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  constexpr std::string_view kLine = "\n----\n";
  const std::size_t end = text.find(kLine);
  const fs::path folder = fuzz::scratch_folder() / "evaluation";
  fs::create_directories(folder);
  fuzz::write_scratch(folder / "evaluation.json", text.substr(0, end));
  fuzz::write_scratch(folder / "submission.json", end == std::string::npos ? "{}" : text.substr(end + kLine.size()));
  fuzz::accepted([&] { leaderboard::read_submission(folder); });
  fuzz::accepted([&] {
    const leaderboard::Evaluation read = leaderboard::read_evaluation(folder);
    fuzz::demand(read.results_folder().lexically_normal().parent_path() == folder, "results beside evaluation.json");
    fuzz::write_scratch(folder / "evaluation.json",
                        leaderboard::to_json(read).dump(-1, ' ', false, Json::error_handler_t::replace));
    const leaderboard::Evaluation again = leaderboard::read_evaluation(folder);
    fuzz::demand(again.methods.size() == read.methods.size() && again.date == read.date, "what it wrote itself");
  });
  return 0;
}
