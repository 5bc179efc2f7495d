// A results folder of a stranger: manifest, trials and times, parted by lines "----", into tables, pages and a merge.
#include "records/merge.h"
#include "records/results_folder.h"
#include "report/report.h"
#include "resealed.h"
#include "target.h"

using namespace relign;
namespace fs = std::filesystem;

namespace {

// Cuts off the text up to the next line "----".
std::string_view part(std::string_view& text) {
  constexpr std::string_view kLine = "\n----\n";
  const std::size_t end = text.find(kLine);
  const std::string_view first = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + kLine.size());
  return first;
}

bool has_control(const std::string& text) {
  for (const char letter : text)
    if (static_cast<unsigned char>(letter) < 0x20 && letter != '\n' && letter != '\t') return true;
  return false;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  std::string_view rest = text;
  const fs::path folder = fuzz::scratch_folder() / "results";
  for (const char* name : {"trials", "times", "pictures"}) fs::create_directories(folder / name);
  fuzz::write_scratch(folder / "manifest.json", part(rest));
  fuzz::write_scratch(folder / "trials" / "0000.jsonl", records::resealed(std::string(part(rest))));
  fuzz::write_scratch(folder / "times" / "0000.jsonl", records::resealed(std::string(part(rest))));
  fuzz::write_scratch(folder / "pictures" / "index.json", part(rest));
  fuzz::accepted([&] { records::read_planned_trials(folder); });
  fuzz::accepted([&] {
    const report::Report made(folder);
    fuzz::demand(!has_control(made.ranking_table()), "a ranking for a terminal");
    fuzz::demand(!has_control(made.markdown()), "a page without control bytes");
    const std::string page = made.html();
    for (const char* markup : {"<img src=x", "<script>alert", "<b>bold", "\x1b"})
      fuzz::demand(page.find(markup) == std::string::npos, std::string("a page without ") + markup);
  });
  fuzz::accepted([&] {
    fs::remove_all(fuzz::scratch_folder() / "merged");
    records::MergeOptions options;
    options.sources = {folder};
    options.out = fuzz::scratch_folder() / "merged";
    records::merge(options);
  });
  return 0;
}
