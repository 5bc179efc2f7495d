#include "suites/secret.h"

#include <gmock/gmock.h>

#include "base/commitment.h"
#include "base/error.h"
#include "base/hash.h"

namespace relign::suites {
namespace {

using testing::HasSubstr;

const std::string kSecret(64, 'a');
// printf 'relign-bench commitment\n%s' aa...a | sha256sum
constexpr const char* kCommitment = "sha256:b7099b7a70ac7f40e653755e6daefafdef35a47e8684d700a750e0ed47bc5251";

template <class Call>
std::string complaint(Call call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "";
}

TEST(Secret, IsNewEachTimeAndReadsBack) {
  const std::string one = new_secret(), other = new_secret();
  EXPECT_NE(one, other);
  EXPECT_EQ(read_secret(" " + one + "\r\n", "here"), one);
}

TEST(Secret, OfAnotherFormIsRefused) {
  for (const std::string& bad : {std::string(), std::string(" \n"), std::string(63, '1'), std::string(65, '1'),
                                 std::string(64, 'A'), kSecret + " " + kSecret})
    EXPECT_THAT(complaint([&] { read_secret(bad, "--secret: 'file'"); }),
                HasSubstr("--secret: 'file': expected a secret of 64 hexadecimal digits"))
        << bad;
}

TEST(Secret, CommitmentIsAHashThatAnybodyCanCompute) {
  EXPECT_EQ(commitment_to(kSecret), kCommitment);
  EXPECT_TRUE(is_commitment(kCommitment));
  for (const char* bad : {"", "sha256:", "sha256:12", "md5:00"}) EXPECT_FALSE(is_commitment(bad)) << bad;
}

TEST(Secret, DrawsInstancesAndAlgorithmsFromSeedsOfTheirOwn) {
  Suite suite;
  suite.name = "closed";
  suite.commitment = kCommitment;
  unseal(suite, kSecret);
  // printf 'relign-bench instances\n%s' aa...a | sha256sum, and so on: the first 16 digits.
  EXPECT_EQ(suite.seeds->instances, 0x433777e7ff358e95U);
  EXPECT_EQ(suite.seeds->algorithms, 0x444f398e5e8716f1U);
}

TEST(Secret, OfAnotherSuiteIsRefused) {
  Suite suite;
  suite.name = "closed";
  EXPECT_THAT(complaint([&] { unseal(suite, kSecret); }), HasSubstr("suite 'closed' is not sealed"));
  suite.commitment = commitment_to(std::string(64, 'b'));
  EXPECT_THAT(complaint([&] { unseal(suite, kSecret); }), HasSubstr("this is not the secret of suite 'closed'"));
  EXPECT_FALSE(suite.seeds);
}

}  // namespace
}  // namespace relign::suites
