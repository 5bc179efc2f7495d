#include "suites/secret.h"

#include <sys/random.h>

#include <algorithm>
#include <array>

#include "base/commitment.h"
#include "base/error.h"
#include "base/hash.h"
#include "base/own_command.h"

namespace relign::suites {
namespace {

constexpr std::size_t kDigits = 64;

bool is_hex(std::string_view text) {
  return text.size() == kDigits && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

// The purposes have seeds of their own: an algorithm knows its own seed, from which the instances must not follow.
std::uint64_t seed_from(const std::string& secret, const char* purpose) {
  constexpr std::size_t kDigitsOfSeed = 16;
  return std::stoull(sha256_hex(std::string("relign-bench ") + purpose + "\n" + secret).substr(0, kDigitsOfSeed),
                     nullptr, 16);
}

}  // namespace

std::string new_secret() {
  std::array<unsigned char, kDigits / 2> bytes;
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw Error(ErrorKind::io, "the system gave no random numbers");
  constexpr const char* kHex = "0123456789abcdef";
  std::string secret;
  for (const unsigned char byte : bytes) secret.append({kHex[byte >> 4U], kHex[byte & 15U]});
  return secret;
}

bool is_commitment(const std::string& text) {
  const std::string prefix = kCommitmentPrefix;
  return text.compare(0, prefix.size(), prefix) == 0 && is_hex(std::string_view(text).substr(prefix.size()));
}

std::string read_secret(const std::string& text, const std::string& where) {
  constexpr const char* kSpace = " \t\r\n";
  const std::size_t first = std::min(text.find_first_not_of(kSpace), text.size());
  std::string secret = text.substr(first, text.find_last_not_of(kSpace) + 1 - first);
  if (!is_hex(secret))
    throw Error(ErrorKind::bad_input, where + ": expected a secret of 64 hexadecimal digits (0-9, a-f), as '" +
                                          own_command("seal") + "' writes it");
  return secret;
}

void check_secret(const std::string& secret, const std::string& commitment, const std::string& what) {
  if (const std::string own = commitment_to(secret); own != commitment)
    throw Error(ErrorKind::bad_input, "this is not the secret of " + what + ", which has the commitment " + commitment +
                                          "; the secret's is " + own);
}

void unseal(Suite& suite, const std::string& secret) {
  if (suite.commitment.empty())
    throw Error(ErrorKind::bad_input,
                "suite '" + suite.name + "' is not sealed: it has no \"commitment\", so that it cannot use a secret");
  check_secret(secret, suite.commitment, "suite '" + suite.name + "'");
  suite.seeds = {seed_from(secret, "instances"), seed_from(secret, "algorithms")};
}

}  // namespace relign::suites
