// What algorithms promise that learn beforehand (relign.prepared/1).
#include <limits>

#include "base/error.h"
#include "conformance/checks.h"
#include "conformance/conduct.h"
#include "conformance/progress.h"
#include "conformance/watchdog.h"

namespace relign::conformance {

using plugin_host::Choice;

namespace {

constexpr std::uint32_t kAxes = 5;
constexpr double kCpu_s = 40, kWall_s = 400;  // for one conversation, or for all sources

// One trial with what `preparation` holds; the sentence of its failure, or an empty text.
std::string trial_with(const Choice& choice, FakePreparation preparation, std::uint32_t axes,
                       const std::string& where) {
  at(where);
  Watchdog watchdog;
  watchdog.start(kCpu_s, kWall_s, failed(where + ", it does not come to an end"));
  FakeSetup setup = setup_for(choice, axes);
  setup.merit = noisy(setup.merit);
  setup.budget = 15;
  setup.preparation = &preparation;
  FakeConversation conversation(setup);
  std::string failure;
  try {
    run_trial(choice, conversation);
  } catch (const Error& error) {
    failure = error.what();
  }
  watchdog.stop();
  if (conversation.refused) throw Error(ErrorKind::plugin_failed, where + ", it sends a pose that is not finite");
  return failure;
}

std::string random_bytes(std::size_t count) {
  Random random(11, 3);
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random.bits());
  return bytes;
}

FakePreparation holding(std::string bytes) {
  FakePreparation preparation;
  preparation.bytes = std::move(bytes);
  return preparation;
}

}  // namespace

Finding check_prepared(const Subject& subject) {
  const Choice& choice = subject.choice();
  if (subject.manifest->prepare.is_null()) return skipped("its manifest has no \"prepare\"");
  Watchdog watchdog;
  watchdog.start(kCpu_s, kWall_s, failed("preparing it takes more than 40 s of its own, with 3 sources of 20 steps"));
  at("while it is prepared");
  const FakePreparation learnt = prepare(choice, kAxes);
  if (!learnt.bytes) return failed("it saves nothing while it is prepared");
  if (prepare(choice, kAxes).bytes != learnt.bytes)
    return failed(
        "prepared twice on the same sources, it saves other bytes: draw random numbers from the seed of the task");
  at("while it is prepared with merits that are NaN");
  try {
    prepare(choice, kAxes, [](const Pose&, std::uint32_t) { return std::numeric_limits<double>::quiet_NaN(); });
  } catch (const Error&) {  // it may say that there was nothing to learn
  }
  watchdog.stop();

  const std::string whole = *learnt.bytes;
  if (const std::string failure = trial_with(choice, holding(whole), kAxes, "with what it saved"); !failure.empty())
    return failed("it fails with what it saved itself: " + failure);
  trial_with(choice, {}, kAxes, "with nothing prepared");  // it may need something
  // Bytes come from a file: what is not its own must be refused with a sentence, not taken for knowledge.
  const struct {
    const char* name;
    std::string bytes;
  } rubbish[] = {{"no bytes at all", ""},
                 {"random bytes", random_bytes(4096)},
                 {"zeros", std::string(whole.size(), '\0')},
                 {"half of what it saved", whole.substr(0, whole.size() / 2)}};
  for (const auto& one : rubbish)
    if (trial_with(choice, holding(one.bytes), kAxes, std::string("with ") + one.name + " as prepared data").empty())
      return failed(std::string("it takes ") + one.name + " for prepared data: check what load gives");
  for (std::size_t place = 0; place < 64 && place < whole.size(); ++place) {
    std::string damaged = whole;
    damaged[place * whole.size() / 64 % whole.size()] ^= '\x55';
    trial_with(choice, holding(damaged), kAxes, "with a damaged byte in its prepared data");
  }
  if (trial_with(choice, holding(whole), kAxes - 1, "with data of another number of axes").empty())
    return failed("it takes data of 5 axes for a trial of 4: keep the number of axes in what you save");
  return ok();
}

}  // namespace relign::conformance
