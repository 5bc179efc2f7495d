// For tests: an algorithm written against plugin.h without the wrapper, with the fault that the definition FOREIGN_...
// names.
#include <relign/plugin.h>

#include <cstring>

extern "C" void relign_nobody_defines_this();

struct relign_algorithm {
  int unused;
};

namespace {

[[maybe_unused]] relign_algorithm object;

relign_status create(const relign_host*, const relign_parameters*, [[maybe_unused]] relign_algorithm** made) {
#if defined(FOREIGN_UNDEFINED_SYMBOL)
  relign_nobody_defines_this();
#endif
#if !defined(FOREIGN_NO_OBJECT)
  *made = &object;
#endif
  return RELIGN_OK;
}

[[maybe_unused]] relign_status run(relign_algorithm*, const relign_trial*) {
#if defined(FOREIGN_THROWS)
  throw 7;
#elif defined(FOREIGN_NO_REASON)
  return RELIGN_FAILED;
#elif defined(FOREIGN_UNKNOWN_STATUS)
  return -77;
#else
  return RELIGN_OK;
#endif
}

void destroy(relign_algorithm*) {}

const relign_algorithm_interface table = {
#if defined(FOREIGN_SHORT_TABLE)
    16,
#else
    sizeof(relign_algorithm_interface),
#endif
    0,       create,
#if defined(FOREIGN_NO_RUN)
    nullptr,
#else
    run,
#endif
    destroy, nullptr};

const void* get_interface(relign_text id) {
#if defined(FOREIGN_NO_INTERFACE)
  (void)id;
  (void)table;
  return nullptr;
#else
  return std::strlen(RELIGN_ALGORITHM_INTERFACE) == id.size &&
                 std::memcmp(id.data, RELIGN_ALGORITHM_INTERFACE, static_cast<std::size_t>(id.size)) == 0
             ? &table
             : nullptr;
#endif
}

}  // namespace

#if defined(FOREIGN_NO_ENTRY)
#define ENTRY another_name
#else
#define ENTRY relign_plugin_entry
#endif
extern "C" {
RELIGN_EXPORT extern const relign_plugin_description ENTRY;
const relign_plugin_description ENTRY = {
#if defined(FOREIGN_SHORT_DESCRIPTION)
    8,
#else
    sizeof(relign_plugin_description),
#endif
#if defined(FOREIGN_NEWER_MAJOR)
    RELIGN_ABI_MAJOR + 1,
#elif defined(FOREIGN_OLDER_MAJOR)
    RELIGN_ABI_MAJOR - 1,
#else
    RELIGN_ABI_MAJOR,
#endif
#if defined(FOREIGN_NEWER_MINOR)
    RELIGN_ABI_MINOR + 1,
#else
    RELIGN_ABI_MINOR,
#endif
    0,
    R"({"id": "foreign", "kind": "optimizer", "summary": "For tests."})",
    "foreign compiler 1.0",
    get_interface};
}
