// Reads line files line by line.
#include <cstring>
#include <fstream>

#include "base/error.h"
#include "records/checksum.h"
#include "records/line_files.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

// Calls body(line, offset, number) for every line that has its newline.
template <class Body>
void for_each_line(const fs::path& file, const Body& body) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error(ErrorKind::io, "cannot read '" + file.string() + "': " + std::strerror(errno));
  std::string line;
  std::size_t offset = 0;
  std::size_t number = 0;
  while (std::getline(stream, line)) {
    if (stream.eof()) break;  // half-written
    body(std::string_view(line), offset, ++number);
    offset += line.size() + 1;
  }
  if (stream.bad()) throw Error(ErrorKind::io, "cannot read '" + file.string() + "': " + std::strerror(errno));
}

}  // namespace

void scan_trials(const fs::path& file, std::vector<Damage>& damaged,
                 const std::function<void(const TrialRecord&, const BlockPlace&)>& on_trial,
                 const std::function<void(const std::string&)>& on_incomplete,
                 const std::function<void(std::string_view, std::size_t, std::size_t)>& on_step) {
  BlockFinder finder(file.string());
  for_each_line(file, [&](std::string_view line, std::size_t offset, std::size_t number) {
    const BlockFinder::Line found = finder.add(line, offset, number);
    if (found == BlockFinder::Line::closing)
      on_trial(finder.closed(),
               {finder.begin(), offset + line.size() + 1 - finder.begin(), finder.first_line(), finder.closed_steps()});
    else if (found == BlockFinder::Line::step && on_step)
      on_step(line, number, finder.steps() - 1);
  });
  const std::vector<std::string> incomplete = finder.take_incomplete();
  for (Damage& damage : finder.take_damaged()) damaged.push_back(std::move(damage));
  if (!on_incomplete) return;
  for (const std::string& trial : incomplete) on_incomplete(trial);
}

void scan_times(const fs::path& file, std::vector<Damage>& damaged,
                const std::function<void(const std::string&, const BlockPlace&)>& on_trial) {
  // to_line always writes this start; parsing every number of a million lines would take a minute.
  static const std::string start = "{\"format\":" + std::to_string(kFormat) + ",\"trial\":\"";
  for_each_line(file, [&](std::string_view line, std::size_t offset, std::size_t number) {
    const std::size_t quote = line.find('"', start.size());
    const bool ours = line.substr(0, start.size()) == start && quote != std::string_view::npos && line.back() == '}';
    if (ours && line_is_intact(line)) {
      on_trial(std::string(line.substr(start.size(), quote - start.size())), {offset, line.size() + 1, number});
    } else if (std::optional<Damage> damage = damaged_times(line, file.string(), number)) {
      damaged.push_back(std::move(*damage));
    } else {
      on_trial(read_times_line(line, "").trial, {offset, line.size() + 1, number});
    }
  });
}

}  // namespace relign::records
