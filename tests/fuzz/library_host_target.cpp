// What the host of a library in a process of its own reads: the task of a trial, then an answer to each of its
// requests. Each line of an input is one message; where they end, the host answers "stop".
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <vector>

#include "base/error.h"
#include "base/fault.h"
#include "sandbox/connection.h"
#include "sandbox/remote_trial.h"
#include "target.h"

using namespace relign;

namespace {

constexpr std::size_t kImageBytes = 4096;  // of the shared memory: two images of 8 x 8, and a model's

relign_text view(const char* text) { return {text, std::strlen(text)}; }

void read(void* context, relign_text text) {
  *static_cast<std::size_t*>(context) += text.size > 0 ? static_cast<unsigned char>(text.data[text.size - 1]) : 0;
}

void read_image(const relign_image* image) {
  if (!image) return;
  double sum = 0;
  for (std::uint32_t y = 0; y < image->height; ++y)
    for (std::uint32_t x = 0; x < image->width; ++x)
      sum += *reinterpret_cast<const float*>(reinterpret_cast<const char*>(image->pixels) +
                                             y * image->row_stride_bytes + x * sizeof(float));
  volatile double used = sum;
  static_cast<void>(used);
}

template <class Service>
const Service* service(const relign_trial& trial, const char* id) {
  return static_cast<const Service*>(trial.get_service(trial.context, view(id)));
}

// An algorithm that requests everything once, and reads all that it gets.
void request_everything(const relign_trial& trial) {
  std::size_t seen = 0;
  const relign_text_sink sink = {sizeof sink, 0, &seen, read};
  relign_observation observation{};
  observation.struct_size = sizeof observation;
  const double pose[2] = {0.5, 0.25};
  if (trial.first(trial.context, &observation) == RELIGN_OK) read_image(observation.image);
  trial.step(trial.context, pose, 2, &observation);
  trial.move(trial.context, pose, 2, &observation);
  trial.recommend(trial.context, pose, 2);
  if (const auto* of = service<relign_reference_service>(trial, RELIGN_SERVICE_REFERENCE)) read_image(of->image);
  if (const auto* of = service<relign_measures_service>(trial, RELIGN_SERVICE_MEASURES)) {
    double value = 0;
    relign_field_measures fields{};
    fields.struct_size = sizeof fields;
    of->list(of->context, &sink);
    of->measure(of->context, view("mtf"), view("{}"), &value);
    if (of->fields(of->context, view("{}"), &fields) == RELIGN_OK)
      for (std::uint32_t i = 0; i < fields.count; ++i) read(&seen, fields.name[i]);
    trial.why(trial.context, &sink);
  }
  if (const auto* of = service<relign_prior_service>(trial, RELIGN_SERVICE_PRIOR)) of->draw(of->context, 1, &sink);
  if (const auto* of = service<relign_run_service>(trial, RELIGN_SERVICE_RUN)) {
    relign_run_outcome outcome{};
    outcome.struct_size = sizeof outcome;
    of->run(of->context, view("next"), view("{}"), 3, &outcome);
    if (outcome.last) read_image(outcome.last->image);
  }
  if (const auto* of = service<relign_model_service>(trial, RELIGN_SERVICE_MODEL)) {
    relign_model_lens* lens = nullptr;
    of->mount(of->context, view("{}"), &lens);
    std::vector<float> pixels(kImageBytes);
    if (std::uint64_t{of->image_width} * of->image_height <= pixels.size())
      of->capture(of->context, lens, pose, 2, 7, pixels.data());
    of->unmount(of->context, lens);
  }
  if (const auto* of = service<relign_history_service>(trial, RELIGN_SERVICE_HISTORY)) {
    double shift[2];
    for (std::uint32_t back = 0; back < 3; ++back) of->cure_shift(of->context, back, shift, 2);
  }
  if (const auto* of = service<relign_prepared_service>(trial, RELIGN_SERVICE_PREPARED)) {
    of->load(of->context, &sink);
    of->save(of->context, view("data"));
  }
}

// As library_host.cpp treats what escapes.
void as_in_the_host(sandbox::Connection& connection) {
  try {
    const Json run = connection.receive();
    const sandbox::RemoteTrial trial(connection, run.at("task"));
    request_everything(trial.table());
  } catch (const Json::exception& error) {
    throw Error(ErrorKind::bad_input, fault_text(error));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMostBytes = 60'000;  // that a socket takes at once
  std::string text = fuzz::text_of(data, std::min(size, kMostBytes));
  for (int i = 0; i < 40; ++i) text += "\n{\"message\":\"stop\"}";
  text += "\n";
  static const int shared = [] {
    const int made = ::memfd_create("pixels", MFD_CLOEXEC);
    fuzz::demand(made >= 0, "shared memory");
    return made;
  }();
  fuzz::demand(::ftruncate(shared, kImageBytes) == 0, "shared memory of its size");
  int ends[2];
  fuzz::demand(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0, "a pair of sockets");
  // The requests stay unread: a socket takes them all.
  int requests[2];
  fuzz::demand(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, requests) == 0, "a pair of sockets");
  fuzz::demand(::send(ends[0], text.data(), text.size(), MSG_DONTWAIT) == static_cast<ssize_t>(text.size()),
               "a socket that takes an input");
  fuzz::accepted([&] {
    sandbox::Connection connection(ends[1], requests[1], shared);
    as_in_the_host(connection);
  });
  for (const int one : {ends[0], ends[1], requests[0], requests[1]}) ::close(one);
  return 0;
}
