#include "base/hash.h"

#include <openssl/evp.h>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"

namespace relign {

std::string sha256_hex(std::string_view content) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  if (EVP_Digest(content.data(), content.size(), digest, &size, EVP_sha256(), nullptr) != 1)
    throw Error(ErrorKind::internal, "OpenSSL does not provide SHA-256");
  return to_hex({reinterpret_cast<const char*>(digest), size});
}

std::string sha256_file(const std::filesystem::path& path) { return sha256_hex(read_file(path)); }

std::string short_hash(std::string_view content) { return sha256_hex(content).substr(0, 16); }

}  // namespace relign
