#include "base/hash.h"

#include <openssl/evp.h>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"

namespace relign {

struct Sha256::Context {
  EVP_MD_CTX* state = EVP_MD_CTX_new();
  ~Context() { EVP_MD_CTX_free(state); }
};

namespace {

void require(bool done) {
  if (!done) throw Error(ErrorKind::internal, "OpenSSL does not provide SHA-256");
}

}  // namespace

Sha256::Sha256() : context_(std::make_unique<Context>()) { begin(); }
Sha256::~Sha256() = default;

void Sha256::begin() {
  require(context_->state != nullptr && EVP_DigestInit_ex(context_->state, EVP_sha256(), nullptr) == 1);
}

void Sha256::add(std::string_view part) { require(EVP_DigestUpdate(context_->state, part.data(), part.size()) == 1); }

std::string Sha256::hex() {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  require(EVP_DigestFinal_ex(context_->state, digest, &size) == 1);
  return to_hex({reinterpret_cast<const char*>(digest), size});
}

std::string sha256_hex(std::string_view content) {
  Sha256 hash;
  hash.add(content);
  return hash.hex();
}

std::string sha256_file(const std::filesystem::path& path) { return sha256_hex(read_file(path)); }

std::string short_hash(std::string_view content) { return sha256_hex(content).substr(0, 16); }

}  // namespace relign
