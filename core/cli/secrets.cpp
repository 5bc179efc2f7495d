#include "cli/secrets.h"

#include <cstdlib>

#include "base/error.h"
#include "base/files.h"
#include "suites/secret.h"

namespace relign::cli {
namespace {

constexpr const char* kVariable = "RELIGN_SECRET";

}  // namespace

void add_secret_option(CLI::App& verb, std::string& file) {
  verb.add_option("--secret", file,
                  "file with the secret of a sealed suite [default: environment variable RELIGN_SECRET]")
      ->type_name("FILE");
}

std::optional<std::string> given_secret(const std::string& file) {
  const char* variable = std::getenv(kVariable);
  const std::optional<std::string> inherited = variable ? std::optional<std::string>(variable) : std::nullopt;
  unsetenv(kVariable);
  if (!file.empty()) return suites::read_secret(read_file(file), "--secret: '" + file + "'");
  if (inherited) return suites::read_secret(*inherited, kVariable);
  return std::nullopt;
}

std::string missing_secret(const std::string& what) {
  return what + " is sealed: its instances need the secret; give its file with --secret FILE, or the secret in " +
         kVariable;
}

void unseal_suite(suites::Suite& suite, const std::string& file) {
  const bool sealed = !suite.commitment.empty();
  if (!sealed && file.empty()) return;
  const std::optional<std::string> secret = given_secret(file);
  if (!secret) throw Error(ErrorKind::bad_input, missing_secret("suite '" + suite.name + "'"));
  suites::unseal(suite, *secret);
}

}  // namespace relign::cli
