#include "sandbox/remote_trial.h"

#include <limits>
#include <map>

#include "base/error.h"

namespace relign::sandbox {
namespace {

std::uint32_t observed_bits(const Json& words) {
  static const std::map<std::string, std::uint32_t> kBits = {
      {"images", RELIGN_OBSERVES_IMAGES},  {"merit", RELIGN_OBSERVES_MERIT},   {"start", RELIGN_OBSERVES_START},
      {"box", RELIGN_OBSERVES_BOX},        {"design", RELIGN_OBSERVES_DESIGN}, {"level", RELIGN_OBSERVES_LEVEL},
      {"history", RELIGN_OBSERVES_HISTORY}};
  std::uint32_t bits = 0;
  for (const Json& word : words) {
    const auto known = kBits.find(word.get<std::string>());
    if (known == kBits.end())
      throw Error(ErrorKind::bad_input, "the host named the unknown observation '" + word.get<std::string>() + "'");
    bits |= known->second;
  }
  return bits;
}

// The host's text of the axes, byte for byte.
std::string axes_text(const std::string& line, const Json& task) {
  const std::string before = R"("axes":)";
  const std::size_t begin = line.find(before), end = line.find(R"(,"budget":)");
  if (begin == std::string::npos || end == std::string::npos) return task.at("axes").dump();
  return line.substr(begin + before.size(), end - begin - before.size());
}

}  // namespace

RemoteTrial::RemoteTrial(Connection& connection, const Json& task)
    : connection_(connection), axes_json_(axes_text(connection.last_line(), task)), services_(connection, task) {
  readings_json_ = task.value("readings", Json::array()).dump();
  task_.struct_size = sizeof task_;
  task_.axes = static_cast<std::uint32_t>(task.at("axes").size());
  task_.budget = task.at("budget").get<std::uint32_t>();
  task_.seed = task.at("seed").get<std::uint64_t>();
  task_.observes = observed_bits(task.at("observes"));
  task_.largest_move = task.at("largest_move").is_null() ? std::numeric_limits<double>::infinity()
                                                         : task.at("largest_move").get<double>();
  task_.axes_json = {axes_json_.data(), axes_json_.size()};
  task_.readings_json = {readings_json_.data(), readings_json_.size()};
  if (const auto box = task.find("box"); box != task.end()) {
    box_lower_ = numbers(box->at("lower"));
    box_upper_ = numbers(box->at("upper"));
    task_.box_lower = box_lower_.data();
    task_.box_upper = box_upper_.data();
  }
  if (const auto image = task.find("image"); image != task.end()) {
    task_.image_width = image->at("width").get<std::uint32_t>();
    task_.image_height = image->at("height").get<std::uint32_t>();
  }
  table_.struct_size = sizeof table_;
  table_.context = this;
  table_.task = &task_;
  table_.first = [](void* context, relign_observation* seen) {
    return self(context).ask("{\"message\":\"first\"}\n", seen);
  };
  table_.step = [](void* context, const double* pose, std::uint32_t axes, relign_observation* seen) {
    return self(context).ask_with_pose("step", "pose", pose, axes, seen);
  };
  table_.move = [](void* context, const double* delta, std::uint32_t axes, relign_observation* seen) {
    return self(context).ask_with_pose("move", "delta", delta, axes, seen);
  };
  table_.recommend = [](void* context, const double* pose, std::uint32_t axes) {
    relign_observation none{};
    none.struct_size = sizeof none;
    return self(context).ask_with_pose("recommend", "pose", pose, axes, &none);
  };
  table_.get_service = [](void* context, relign_text id) -> const void* {
    if (!id.data || std::this_thread::get_id() != self(context).thread_) return nullptr;
    return self(context).services_.get({id.data, static_cast<std::size_t>(id.size)});
  };
  table_.why = [](void* context, const relign_text_sink* reason) -> relign_status {
    if (!reason) return RELIGN_BAD_ARGUMENT;
    const std::string& why = self(context).services_.why();
    reason->write(reason->context, {why.data(), why.size()});
    return RELIGN_OK;
  };
}

relign_status RemoteTrial::ask_with_pose(const char* message, const char* member, const double* values,
                                         std::uint32_t count, relign_observation* seen) {
  std::string line = std::string("{\"message\":\"") + message + "\",\"" + member + "\":";
  add_exact(line, values, values ? count : 0);
  return ask(line + "}\n", seen);
}

relign_status RemoteTrial::ask(const std::string& line, relign_observation* seen) {
  constexpr std::size_t kSmallest = offsetof(relign_observation, machine_seconds) + sizeof(double);
  if (!seen || seen->struct_size < kSmallest || std::this_thread::get_id() != thread_) return RELIGN_BAD_ARGUMENT;
  connection_.send_line(line);
  const Json answer = connection_.receive();
  if (answer.at("message") == "observation") {
    latest_.take(answer, services_.latest_image());
    latest_.write(seen);
  }
  return status_of(answer);
}

}  // namespace relign::sandbox
